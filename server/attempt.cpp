#include "attempt.h"

#include <system_error>
#include <utility>

namespace bedflow::server {

std::string heartbeat_of(const JobFolder& folder) {
  std::string beat = read_text(folder.heartbeat());  // opening it also has a network file system look at the server's copy
  std::error_code missing;
  const auto touched = std::filesystem::last_write_time(folder.heartbeat(), missing);
  // The time too: on a disk that is full from the start there is no room for the count.
  return missing ? std::string() : beat + " " + std::to_string(touched.time_since_epoch().count());
}

Attempt::Attempt(JobFolder folder, std::uint32_t epoch) : folder_(std::move(folder)), epoch_(epoch), reader_(folder_.events()) {}

bool Attempt::look(const std::shared_ptr<Feed>& feed) {
  if (auto beat = heartbeat_of(folder_); beat != heartbeat_) {  // a change is told, not an age: clocks may jump, and differ
    heartbeat_ = std::move(beat);
    heard_ = std::chrono::steady_clock::now();
  }
  const auto before = last_sequence_;
  if (!damaged_) {
    damaged_ = !reader_.read([&](const LogRecord& record) {
      auto event = std::make_shared<const v1::Event>(event_of(record));
      take(*event);
      if (feed) feed->add(std::move(event));
    });
  }
  if (damaged_ && feed) feed->set_damaged();
  return last_sequence_ != before;
}

void Attempt::take(const v1::Event& event) {
  last_sequence_ = event.sequence();
  if (event.has_progress()) progress_ = event.progress();
  if (event.has_checkpoint()) checkpoint_ = event;
  if (event.epoch() != epoch_) return;  // history, or an engine that has been replaced
  heard_ = std::chrono::steady_clock::now();
  if (event.has_started()) {
    started_ = true;
    start_step_ = event.started().step();
  }
  if (event.has_stopped()) stopped_ = event.stopped();
}

std::int64_t Attempt::ended_unix_nanos() const {
  v1::ExitRecord record;
  if (read_message(folder_.exit_record(epoch_), record) && record.has_unix_nanos()) return record.unix_nanos();
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

Ending Attempt::ending() const {
  if (stopped_) return {stopped_->reason(), stopped_->message()};
  const std::string log = last_lines(folder_.error_log(epoch_));
  const std::string said = log.empty() ? "" : "; its last words: " + log;
  v1::ExitRecord record;
  if (!read_message(folder_.exit_record(epoch_), record)) {
    return {v1::RANK_DIED, "the engine and its runner ended without a word" + said};
  }
  const std::string code = std::to_string(record.exit_code());
  if (record.exit_code() == 127) return {v1::BACKEND_ERROR, "the engine could not be started" + said};
  if (record.exit_code() == v1::DISK_FULL)
    return {v1::DISK_FULL, "the disk is full; make room on it, then resume the job" + said};
  // The last event may not have been written: then the exit code is the word.
  if (record.exit_code() >= v1::INVALID_CASE && v1::StopReason_IsValid(record.exit_code())) {
    return {static_cast<v1::StopReason>(record.exit_code()), "the engine ended with exit code " + code + said};
  }
  return {v1::RANK_DIED, "a process of the engine died (exit code " + code + ")" + said};
}

}  // namespace bedflow::server
