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

// What the watchers of a job share: its newest events, so that a thousand of them cost one reading of the log, and its changes of
// state since somebody began to look, each with the newest event at that moment (last_sequence).
class Feed {
 public:
  explicit Feed(std::uint64_t newest) : newest_(newest) {}  // events up to this one are in the log alone

  void add(std::shared_ptr<const v1::Event> event);  // in order; what is known already is passed over
  void add(const v1::Job& job);
  void set_damaged();  // the log: no more events will come

  struct News {
    std::shared_ptr<const v1::Event> event;  // the next one, if it is still here
    std::uint64_t newest = 0;                // event that there is
    std::uint64_t newest_progress = 0;
    bool damaged = false;
  };
  News behind(std::uint64_t sequence) const;
  std::size_t changes() const;
  std::optional<v1::Job> change(std::size_t index) const;

 private:
  mutable std::mutex mutex_;
  std::deque<std::shared_ptr<const v1::Event>> tail_;  // up to newest_, without a gap
  std::uint64_t newest_;
  std::uint64_t newest_progress_ = 0;
  bool damaged_ = false;
  std::vector<v1::Job> changes_;
};

// One watcher's place: events in order of their numbers, changes of state behind the event that was the newest when they
// happened. Feed and log are the queue: a slow reader costs a bounded number of events in memory and misses none, but for
// progress that has been overtaken by newer progress while it did not read; what is left out is counted, and history never is.
class Cursor {
 public:
  // job: as it is now, the first answer. after: the resume token.
  Cursor(std::filesystem::path log, const v1::Job& job, std::shared_ptr<const Feed> feed, std::uint64_t after);

  // The next answer, if there is one. Throws Refusal(log_damaged).
  std::optional<v1::WatchJobResponse> next();
  bool has_ended() const;  // the job is final and all of it has been given
  std::uint64_t sequence() const { return sequence_; }

 private:
  v1::WatchJobResponse answer() const;
  v1::WatchJobResponse job_answer(const v1::Job& job);
  std::shared_ptr<const v1::Event> next_event();
  bool is_overtaken(const v1::Event& event) const;
  void read_more();

  LogReader reader_;
  std::shared_ptr<const Feed> feed_;
  std::size_t next_change_;
  std::uint64_t sequence_;
  std::uint64_t history_;  // the newest event when the watch began
  v1::Job job_;            // newest that was given
  bool first_ = true;
  std::shared_ptr<const v1::Event> event_;               // read, not given yet
  std::deque<std::shared_ptr<const v1::Event>> events_;  // from the log, behind that one
  std::uint64_t merged_ = 0;                             // progress left out since the last answer
};

v1::Event event_of(const LogRecord& record);

}  // namespace bedflow::server
