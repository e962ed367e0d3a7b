#include "watch.h"

#include <utility>

#include "refusal.h"
#include "service.h"

namespace bedflow::server {

class Watcher : public grpc::ServerWriteReactor<v1::WatchJobResponse> {
 public:
  Watcher(Watchers& all, std::string id, Cursor cursor, Caller caller)
      : all_(all), id_(std::move(id)), caller_(std::move(caller)), cursor_(std::move(cursor)) {}

  // Sends what there is, if nothing is being sent. From any thread; at most one write is in flight.
  void go_on() {
    std::unique_lock guard(mutex_);
    if (writing_ || finished_) return;
    const auto status = next_or_end();
    if (status) {
      finished_ = true;
      guard.unlock();
      Finish(*status);
    } else if (writing_) {
      last_write_ = std::chrono::steady_clock::now();
      guard.unlock();
      StartWrite(&message_);
    }
  }

  void OnWriteDone(bool ok) override {
    {
      const std::lock_guard guard(mutex_);
      writing_ = false;
      gone_ = gone_ || !ok;
    }
    go_on();
  }

  void OnCancel() override {
    {
      const std::lock_guard guard(mutex_);
      gone_ = true;
    }
    go_on();
  }

  void OnDone() override { all_.remove(id_, this); }

 private:
  // The status to end with; or a message to write (writing_); or neither.
  std::optional<grpc::Status> next_or_end() {
    if (gone_) return grpc::Status::CANCELLED;
    if (all_.draining_) {
      return status_of(
          {Refused::going_down,
           "the server is going down, the job is not; reconnect with after_sequence " + std::to_string(cursor_.sequence()),
           "bedflow watch " + id_});
    }
    try {
      caller_.require_still_good();
      auto response = cursor_.next();
      if (!response && cursor_.has_ended()) return grpc::Status::OK;
      if (!response && std::chrono::steady_clock::now() - last_write_ >= all_.bookmark_after_) {
        response.emplace();
        response->set_bookmark(true);
        response->set_sequence(cursor_.sequence());
      }
      writing_ = response.has_value();
      if (response) message_ = std::move(*response);
      return std::nullopt;
    } catch (const Refusal& refusal) {
      return status_of(refusal);
    } catch (const std::exception& failure) {
      return grpc::Status(grpc::StatusCode::INTERNAL, failure.what());
    }
  }

  Watchers& all_;
  const std::string id_;
  const Caller caller_;
  std::mutex mutex_;
  Cursor cursor_;
  v1::WatchJobResponse message_;
  bool writing_ = false;
  bool gone_ = false;
  bool finished_ = false;
  std::chrono::steady_clock::time_point last_write_ = std::chrono::steady_clock::now();
};

grpc::ServerWriteReactor<v1::WatchJobResponse>* Watchers::open(const std::string& id, Cursor cursor, Caller caller) {
  auto watcher = std::make_shared<Watcher>(*this, id, std::move(cursor), std::move(caller));
  {
    const std::lock_guard guard(mutex_);
    watchers_.emplace(id, watcher);
  }
  watcher->go_on();
  return watcher.get();
}

void Watchers::wake(const std::set<std::string>& ids) {
  std::vector<std::shared_ptr<Watcher>> woken;
  {
    const std::lock_guard guard(mutex_);
    for (const auto& id : ids) {
      for (auto [entry, end] = watchers_.equal_range(id); entry != end; ++entry) woken.push_back(entry->second);
    }
  }
  for (const auto& watcher : woken) watcher->go_on();
}

void Watchers::wake_all() {
  std::vector<std::shared_ptr<Watcher>> woken;
  {
    const std::lock_guard guard(mutex_);
    for (const auto& [id, watcher] : watchers_) woken.push_back(watcher);
  }
  for (const auto& watcher : woken) watcher->go_on();
}

void Watchers::drain() {
  draining_ = true;
  wake_all();
}

std::size_t Watchers::count() const {
  const std::lock_guard guard(mutex_);
  return watchers_.size();
}

void Watchers::remove(const std::string& id, const Watcher* watcher) {
  std::shared_ptr<Watcher> last;  // destroyed outside the lock
  const std::lock_guard guard(mutex_);
  for (auto [entry, end] = watchers_.equal_range(id); entry != end; ++entry) {
    if (entry->second.get() != watcher) continue;
    last = std::move(entry->second);
    watchers_.erase(entry);
    return;
  }
}

}  // namespace bedflow::server
