#include "follow.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "refusal.h"
#include "states.h"

namespace bedflow::server {

LogNotifier::LogNotifier()
    : inotify_(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK)), poked_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (inotify_ < 0 || poked_ < 0) throw std::system_error(errno, std::generic_category(), "inotify");
}

LogNotifier::~LogNotifier() {
  ::close(inotify_);
  ::close(poked_);
}

void LogNotifier::add(const std::filesystem::path& file) {
  const int watch = ::inotify_add_watch(inotify_, file.c_str(), IN_MODIFY);
  if (watch >= 0) watched_[file] = watch;
}

void LogNotifier::remove(const std::filesystem::path& file) {
  const auto entry = watched_.find(file);
  if (entry == watched_.end()) return;
  ::inotify_rm_watch(inotify_, entry->second);
  watched_.erase(entry);
}

void LogNotifier::poke() {
  ::eventfd_write(poked_, 1);
}

void LogNotifier::wait(std::chrono::milliseconds most) {
  std::array<pollfd, 2> sources{{{inotify_, POLLIN, 0}, {poked_, POLLIN, 0}}};
  ::poll(sources.data(), sources.size(), static_cast<int>(most.count()));
  // What has happened is found by reading the logs themselves; here it is only taken away.
  std::array<char, 16384> taken;
  while (::read(inotify_, taken.data(), taken.size()) > 0) {
  }
  eventfd_t count = 0;
  ::eventfd_read(poked_, &count);
}

void StateLog::add(const v1::Job& job) {
  const std::lock_guard guard(mutex_);
  changes_.push_back(job);
}

std::size_t StateLog::size() const {
  const std::lock_guard guard(mutex_);
  return changes_.size();
}

std::optional<v1::Job> StateLog::at(std::size_t index) const {
  const std::lock_guard guard(mutex_);
  if (index >= changes_.size()) return std::nullopt;
  return changes_[index];
}

v1::Event event_of(const LogRecord& record) {
  v1::Event event;
  event.ParseFromString(record.payload);
  event.set_sequence(record.sequence);
  return event;
}

Cursor::Cursor(std::filesystem::path log, const v1::Job& job, std::shared_ptr<const StateLog> changes, std::uint64_t after)
    : reader_(std::move(log)), changes_(std::move(changes)), next_change_(changes_->size()), sequence_(after), job_(job) {}

v1::WatchJobResponse Cursor::answer() const {
  v1::WatchJobResponse response;
  response.set_sequence(sequence_);
  return response;
}

void Cursor::read_more() {
  constexpr std::size_t most = 256;
  bool skipped = true;
  while (events_.empty() && skipped) {
    skipped = false;
    const bool sound = reader_.read_up_to(most, [&](const LogRecord& record) {
      if (record.sequence > sequence_) {
        events_.push_back(event_of(record));
      } else {
        skipped = true;
      }
    });
    if (!sound && events_.empty()) {
      throw Refusal(Refused::log_damaged, "the event log is damaged behind event " + std::to_string(sequence_));
    }
  }
}

std::optional<v1::WatchJobResponse> Cursor::next() {
  if (std::exchange(first_, false)) {
    auto response = answer();
    *response.mutable_job() = job_;
    return response;
  }
  const auto change = changes_->at(next_change_);
  if (events_.empty()) read_more();
  if (change && (change->last_sequence() <= sequence_ || events_.empty())) {
    ++next_change_;
    job_ = *change;
    auto response = answer();
    *response.mutable_job() = job_;
    return response;
  }
  if (events_.empty()) return std::nullopt;
  sequence_ = events_.front().sequence();
  auto response = answer();
  *response.mutable_event() = std::move(events_.front());
  events_.pop_front();
  return response;
}

bool Cursor::has_ended() const {
  return is_final(job_.state()) && events_.empty() && !changes_->at(next_change_);
}

}  // namespace bedflow::server
