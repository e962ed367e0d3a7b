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

void Feed::add(std::shared_ptr<const v1::Event> event) {
  constexpr std::size_t most = 1024;  // whoever is further behind reads the log
  const std::lock_guard guard(mutex_);
  if (event->sequence() <= newest_) return;
  if (event->sequence() != newest_ + 1) tail_.clear();
  newest_ = event->sequence();
  if (event->has_progress()) newest_progress_ = newest_;
  tail_.push_back(std::move(event));
  if (tail_.size() > most) tail_.pop_front();
}

void Feed::add(const v1::Job& job) {
  const std::lock_guard guard(mutex_);
  changes_.push_back(job);
}

void Feed::set_damaged() {
  const std::lock_guard guard(mutex_);
  damaged_ = true;
}

Feed::News Feed::behind(std::uint64_t sequence) const {
  const std::lock_guard guard(mutex_);
  News news{nullptr, newest_, newest_progress_, damaged_};
  const std::uint64_t first = newest_ + 1 - tail_.size();
  if (sequence + 1 >= first && sequence < newest_) news.event = tail_[sequence + 1 - first];
  return news;
}

std::size_t Feed::changes() const {
  const std::lock_guard guard(mutex_);
  return changes_.size();
}

std::optional<v1::Job> Feed::change(std::size_t index) const {
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

Cursor::Cursor(std::filesystem::path log, const v1::Job& job, std::shared_ptr<const Feed> feed, std::uint64_t after)
    : reader_(std::move(log)),
      feed_(std::move(feed)),
      next_change_(feed_->changes()),
      sequence_(after),
      history_(job.last_sequence()),
      job_(job) {}

v1::WatchJobResponse Cursor::answer() const {
  v1::WatchJobResponse response;
  response.set_sequence(sequence_);
  return response;
}

v1::WatchJobResponse Cursor::job_answer(const v1::Job& job) {
  job_ = job;
  auto response = answer();
  *response.mutable_job() = job_;
  return response;
}

void Cursor::read_more() {
  constexpr std::size_t most = 256;
  bool skipped = true;
  while (events_.empty() && skipped) {
    skipped = false;
    const bool sound = reader_.read_up_to(most, [&](const LogRecord& record) {
      if (record.sequence > sequence_) {
        events_.push_back(std::make_shared<const v1::Event>(event_of(record)));
      } else {
        skipped = true;
      }
    });
    if (!sound && events_.empty()) {
      throw Refusal(Refused::log_damaged, "the event log is damaged behind event " + std::to_string(sequence_));
    }
  }
}

// From what has been read, from the feed, from the log; nothing when there is none yet.
std::shared_ptr<const v1::Event> Cursor::next_event() {
  if (events_.empty()) {
    auto news = feed_->behind(sequence_);
    if (news.event) return news.event;
    if (news.newest > sequence_) read_more();
    if (events_.empty() && news.damaged) {
      throw Refusal(Refused::log_damaged, "the event log is damaged behind event " + std::to_string(sequence_));
    }
    if (events_.empty()) return nullptr;
  }
  auto event = std::move(events_.front());
  events_.pop_front();
  return event;
}

bool Cursor::is_overtaken(const v1::Event& event) const {
  constexpr std::uint64_t far_behind = 64;  // events: more than any reader is that takes what it gets
  if (!event.has_progress() || event.sequence() <= history_) return false;
  const auto news = feed_->behind(sequence_);
  return news.newest > sequence_ + far_behind && news.newest_progress > event.sequence();
}

std::optional<v1::WatchJobResponse> Cursor::next() {
  if (std::exchange(first_, false)) return job_answer(job_);
  if (!event_) event_ = next_event();
  while (event_ && is_overtaken(*event_)) {
    sequence_ = event_->sequence();
    ++merged_;
    event_ = next_event();
  }
  const auto change = feed_->change(next_change_);
  if (change && (change->last_sequence() <= sequence_ || !event_)) {
    ++next_change_;
    return job_answer(*change);
  }
  if (!event_) return std::nullopt;
  sequence_ = event_->sequence();
  auto response = answer();
  *response.mutable_event() = *std::exchange(event_, nullptr);
  if (merged_ > 0) response.set_merged(std::exchange(merged_, 0));
  return response;
}

bool Cursor::has_ended() const {
  return is_final(job_.state()) && !event_ && events_.empty() && !feed_->change(next_change_);
}

}  // namespace bedflow::server
