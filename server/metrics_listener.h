// GET /metrics over HTTP, on a Unix socket or on loopback: for Prometheus and for people with curl.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace bedflow::server {

class MetricsListener {
 public:
  // address: "unix:PATH" or "HOST:PORT". Throws std::invalid_argument for one that is none, or that is beyond this machine unless
  // the operator says so (beyond); std::system_error when it cannot be listened on.
  MetricsListener(const std::string& address, bool beyond, std::function<std::string()> text);
  ~MetricsListener();
  MetricsListener(const MetricsListener&) = delete;
  MetricsListener& operator=(const MetricsListener&) = delete;

  const std::string& address() const;  // with the port that was given, where 0 was asked for

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace bedflow::server
