// WatchJob's streams. A watcher has one write in flight and a place in the job's log (Cursor); it is woken when the job has news.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "bedflow/v1/service.pb.h"
#include "caller.h"
#include "follow.h"

namespace bedflow::server {

class Watcher;

class Watchers {
 public:
  explicit Watchers(std::chrono::milliseconds bookmark_after) : bookmark_after_(bookmark_after) {}

  // gRPC owns what this returns, until it is done with it.
  grpc::ServerWriteReactor<v1::WatchJobResponse>* open(const std::string& id, Cursor cursor, Caller caller);
  void wake(const std::set<std::string>& ids);
  void wake_all();  // those that are due a bookmark send it
  void drain();     // ends all streams: the server goes down, the jobs do not
  std::size_t count() const;

 private:
  friend class Watcher;
  void remove(const std::string& id, const Watcher* watcher);

  const std::chrono::milliseconds bookmark_after_;
  std::atomic<bool> draining_ = false;
  mutable std::mutex mutex_;
  std::multimap<std::string, std::shared_ptr<Watcher>> watchers_;
};

}  // namespace bedflow::server
