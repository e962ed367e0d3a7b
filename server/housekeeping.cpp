#include "housekeeping.h"

#include <spdlog/spdlog.h>

#include <exception>
#include <tuple>
#include <utility>

namespace bedflow::server {

Housekeeping::Housekeeping(Jobs& jobs, Readers& readers, OperatingSettings settings)
    : jobs_(jobs), settings_(std::move(settings)), book_(jobs), retention_(jobs, readers, settings_.retention) {}

void Housekeeping::start(Traffic traffic, InUse in_use) {
  traffic_ = std::move(traffic);
  in_use_ = std::move(in_use);
  if (settings_.metrics != "none") {
    listener_.emplace(settings_.metrics, settings_.metrics_beyond_loopback, [this] { return metrics(); });
    spdlog::info("metrics are told on {}", listener_->address());
  }
  thread_ = std::thread([this] { rounds(); });
}

void Housekeeping::stop() {
  {
    const std::lock_guard guard(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
  listener_.reset();
}

void Housekeeping::rounds() {
  std::unique_lock guard(mutex_);
  while (!stopping_) {
    guard.unlock();
    try {
      const auto jobs = book_.look();
      if (retention_.has_duty()) retention_.round(jobs, in_use_());
    } catch (const std::exception& failure) {
      spdlog::error("housekeeping: {}", failure.what());
    }
    guard.lock();
    removed_ = retention_.removed();
    wake_.wait_for(guard, settings_.interval, [this] { return stopping_; });
  }
}

v1::Usage Housekeeping::usage(const v1::GetUsageRequest& request) {
  v1::Usage usage = book_.answer(request);
  const std::lock_guard guard(mutex_);
  usage.set_removed_jobs(removed_.jobs);
  usage.set_removed_checkpoints(removed_.checkpoints);
  usage.set_removed_bytes(removed_.bytes);
  return usage;
}

std::string Housekeeping::metrics() {
  MetricsSources sources;
  sources.jobs = jobs_.figures();
  sources.usage = book_.usage(std::chrono::minutes(1));
  std::tie(sources.watchers, sources.calls) = traffic_();
  {
    const std::lock_guard guard(mutex_);
    sources.removed = removed_;
  }
  return metrics_text(sources, calls_);
}

}  // namespace bedflow::server
