// The server in numbers, as Prometheus reads them (text format 0.0.4).
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/support/server_interceptor.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "jobs.h"
#include "retention.h"

namespace bedflow::server {

// Calls by method and status, and how long the answers took.
class CallMeter {
 public:
  void count(const std::string& method, grpc::StatusCode code, std::chrono::duration<double> time, bool timed);

  static constexpr std::array<double, 9> bounds = {0.001, 0.005, 0.02, 0.1, 0.5, 2, 10, 60, 600};  // s
  struct Times {
    std::array<std::uint64_t, bounds.size() + 1> buckets{};  // each up to its bound; the last: longer
    double sum = 0;                                          // s
  };
  std::map<std::pair<std::string, std::string>, std::uint64_t> counts() const;  // by method and code
  std::map<std::string, Times> times() const;                                   // by method, of calls that do not stream

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, std::string>, std::uint64_t> counts_;
  std::map<std::string, Times> times_;
};

// Has gRPC tell the meter of each call of this service.
class CallMeterFactory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit CallMeterFactory(CallMeter& meter) : meter_(meter) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override;

 private:
  CallMeter& meter_;
};

// Lines "name{labels} value" under their # HELP and # TYPE.
class MetricsText {
 public:
  using Labels = std::vector<std::pair<std::string, std::string>>;
  enum class Type { gauge, counter, histogram };
  void begin(const std::string& name, Type type, const std::string& help);
  void add(const Labels& labels, double value, const std::string& suffix = "");
  void one(const std::string& name, Type type, const std::string& help, double value);
  const std::string& text() const { return text_; }

 private:
  std::string name_, text_;
};

struct MetricsSources {
  Figures jobs;
  v1::Usage usage;
  Removed removed;
  std::size_t watchers = 0, calls = 0;
};
std::string metrics_text(const MetricsSources& sources, const CallMeter& calls);

}  // namespace bedflow::server
