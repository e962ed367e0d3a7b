// Many watchers of one job in one process, by gRPC's callbacks: those that read, and those that are frozen.
#pragma once

#include <grpcpp/grpcpp.h>

#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "bedflow/v1/service.grpc.pb.h"

namespace bedflow::test {

// One stream. A frozen one takes its first message and no more.
class TestWatcher final : public grpc::ClientReadReactor<v1::WatchJobResponse> {
 public:
  TestWatcher(v1::JobService::Stub& stub, const std::string& job, bool frozen) : frozen_(frozen) {
    request_.set_id(job);
    stub.async()->WatchJob(&context_, &request_, this);
    if (frozen_) AddHold();
    StartRead(&response_);
    StartCall();
  }

  void OnReadDone(bool ok) override {
    if (!ok) return;
    {
      const std::lock_guard guard(mutex_);
      ++taken_;
      if (response_.has_job()) states_.push_back(response_.job().state());
      if (response_.has_event()) {
        is_gapless_ = is_gapless_ && response_.event().sequence() == last_ + response_.merged() + 1;
        last_ = response_.event().sequence();
        merged_ += response_.merged();
      }
      if (response_.has_event() && response_.event().has_checkpoint()) ++checkpoints_;
      changed_.notify_all();
      if (frozen_) return;
    }
    StartRead(&response_);
  }
  void OnDone(const grpc::Status&) override {
    const std::lock_guard guard(mutex_);
    done_ = true;
    changed_.notify_all();
  }

  // It reads from now on.
  void thaw() {
    {
      const std::lock_guard guard(mutex_);
      frozen_ = false;
    }
    StartRead(&response_);
    RemoveHold();
  }
  void cancel() {
    context_.TryCancel();
    if (frozen_) RemoveHold();
  }
  bool has_begun(std::chrono::seconds limit) {
    std::unique_lock guard(mutex_);
    return changed_.wait_for(guard, limit, [this] { return taken_ > 0; });
  }
  bool has_ended(std::chrono::seconds limit) {
    std::unique_lock guard(mutex_);
    return changed_.wait_for(guard, limit, [this] { return done_; });
  }

  // Once it has ended.
  const std::vector<v1::JobState>& states() const { return states_; }
  bool is_gapless() const { return is_gapless_; }  // but for what was told to be left out
  std::uint64_t last() const { return last_; }
  std::uint64_t merged() const { return merged_; }
  std::size_t checkpoints() const { return checkpoints_; }

 private:
  bool frozen_;
  v1::WatchJobRequest request_;
  v1::WatchJobResponse response_;
  grpc::ClientContext context_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<v1::JobState> states_;
  std::uint64_t last_ = 0, merged_ = 0;
  std::size_t taken_ = 0, checkpoints_ = 0;
  bool is_gapless_ = true, done_ = false;
};

// So many watchers over connections of 100 streams, the first `frozen` of them frozen.
class Watching {
 public:
  Watching(const std::string& address, const std::string& job, std::size_t count, std::size_t frozen) : frozen_(frozen) {
    for (std::size_t i = 0; i < count; ++i) {
      if (i % 100 == 0) {
        grpc::ChannelArguments settings;
        settings.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
        settings.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);  // the window of a stream stays at 64 KiB
        stubs_.push_back(
            v1::JobService::NewStub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), settings)));
      }
      watchers_.push_back(std::make_unique<TestWatcher>(*stubs_.back(), job, i < frozen));
    }
  }
  ~Watching() {
    for (auto& watcher : watchers_) watcher->cancel();
    for (auto& watcher : watchers_) watcher->has_ended(std::chrono::seconds(60));
  }
  Watching(const Watching&) = delete;
  Watching& operator=(const Watching&) = delete;

  bool have_begun(std::chrono::seconds limit) {
    bool all = true;
    for (auto& watcher : watchers_) all = all && watcher->has_begun(limit);
    return all;
  }
  // Of those that read.
  std::size_t ended(std::chrono::seconds limit) {
    std::size_t count = 0;
    for (std::size_t i = frozen_; i < watchers_.size(); ++i) count += watchers_[i]->has_ended(limit);
    return count;
  }
  const std::vector<std::unique_ptr<TestWatcher>>& all() const { return watchers_; }

 private:
  std::size_t frozen_;
  std::vector<std::unique_ptr<v1::JobService::Stub>> stubs_;
  std::vector<std::unique_ptr<TestWatcher>> watchers_;
};

}  // namespace bedflow::test
