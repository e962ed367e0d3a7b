// Following event logs: news of their growth, and the place of one watcher in one of them.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "bedflow/v1/service.pb.h"
#include "record_log.h"

namespace bedflow::server {

// Waits until one of the files grows (inotify), somebody pokes, or the time is over.
class LogNotifier {
 public:
  LogNotifier();  // throws std::system_error
  ~LogNotifier();
  LogNotifier(const LogNotifier&) = delete;
  LogNotifier& operator=(const LogNotifier&) = delete;

  void add(const std::filesystem::path& file);  // one that cannot be watched is left to the time limit of wait()
  void remove(const std::filesystem::path& file);
  void poke();  // from any thread
  void wait(std::chrono::milliseconds most);

 private:
  int inotify_ = -1;
  int poked_ = -1;  // eventfd
  std::map<std::filesystem::path, int> watched_;
};

// The changes of state of one job since somebody began to look, each with the newest event at that moment (last_sequence).
class StateLog {
 public:
  void add(const v1::Job& job);
  std::size_t size() const;
  std::optional<v1::Job> at(std::size_t index) const;

 private:
  mutable std::mutex mutex_;
  std::vector<v1::Job> changes_;
};

// One watcher's place: events in order of their numbers, changes of state behind the event that was the newest when they
// happened. The log is the queue: a slow reader costs a bounded number of events in memory and misses none.
class Cursor {
 public:
  // job: as it is now, the first answer. after: the resume token.
  Cursor(std::filesystem::path log, const v1::Job& job, std::shared_ptr<const StateLog> changes, std::uint64_t after);

  // The next answer, if there is one. Throws Refusal(log_damaged).
  std::optional<v1::WatchJobResponse> next();
  bool has_ended() const;  // the job is final and all of it has been given
  std::uint64_t sequence() const { return sequence_; }

 private:
  v1::WatchJobResponse answer() const;
  void read_more();

  LogReader reader_;
  std::shared_ptr<const StateLog> changes_;
  std::size_t next_change_;
  std::uint64_t sequence_;
  v1::Job job_;  // newest that was given
  bool first_ = true;
  std::deque<v1::Event> events_;
};

v1::Event event_of(const LogRecord& record);

}  // namespace bedflow::server
