// What the server does beside its jobs: it measures what they take, removes what retention says, and tells its metrics.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "metrics.h"
#include "metrics_listener.h"
#include "retention.h"
#include "usage.h"

namespace bedflow::server {

struct OperatingSettings {
  std::string metrics;  // unix:PATH, HOST:PORT, or none
  bool metrics_beyond_loopback = false;
  RetentionPolicy retention;
  std::chrono::duration<double> interval{10};  // between two rounds
};

class Housekeeping {
 public:
  Housekeeping(Jobs& jobs, Readers& readers, OperatingSettings settings);
  ~Housekeeping() { stop(); }
  Housekeeping(const Housekeeping&) = delete;
  Housekeeping& operator=(const Housekeeping&) = delete;

  using Traffic = std::function<std::pair<std::size_t, std::size_t>()>;  // watchers, and calls in progress
  using InUse = std::function<std::set<std::string>()>;                  // jobs that retention must not remove: those of studies
  // Begins the rounds, and listens for those who read the metrics. Throws what MetricsListener throws.
  void start(Traffic traffic, InUse in_use);
  void stop();

  v1::Usage usage(const v1::GetUsageRequest& request);
  CallMeter& calls() { return calls_; }
  std::string metrics_address() const { return listener_ ? listener_->address() : "none"; }

 private:
  void rounds();
  std::string metrics();

  Jobs& jobs_;
  const OperatingSettings settings_;
  UsageBook book_;
  Retention retention_;
  CallMeter calls_;
  Traffic traffic_;
  InUse in_use_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  Removed removed_;  // as the last round left it
  std::thread thread_;
  std::optional<MetricsListener> listener_;
};

}  // namespace bedflow::server
