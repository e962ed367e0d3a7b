#include "operating_options.h"

#include "size_text.h"

namespace bedflow::server {

void add_operating_options(CLI::App& app, OperatingOptions& options) {
  app.set_config("--config", "", "file with these options, a line each, as in slots = 16; the command line goes before it");
  app.add_option("--metrics", options.metrics,
                 "where Prometheus reads: unix:PATH, 127.0.0.1:PORT or none; unix:DATA/metrics.sock if absent");
  app.add_flag("--metrics-beyond-loopback", options.metrics_beyond_loopback,
               "metrics may be told beyond this machine, without TLS and authentication");
  app.add_option("--log", options.log, "text, or json: an object a line")
      ->capture_default_str()
      ->check(CLI::IsMember({"text", "json"}));
  app.add_option("--disk-reserve", options.reserve, "no job starts while less is free on the disk; as in 20GiB, 0 for none")
      ->capture_default_str();
  app.add_option("--quota", options.quotas,
                 "each:…, all:… or owner/NAME:… with jobs=N, running=N, disk=SIZE; as in each:jobs=100,running=2,disk=50GiB");
  app.add_option("--ended-days", options.ended_days, "jobs that ended so long ago and cannot be resumed are removed; 0: never")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--ended-checkpoints", options.ended_checkpoints,
                 "of a job that has ended or is suspended so many checkpoints stay, and what is pinned; 0: all")
      ->capture_default_str()
      ->check(CLI::Range(0, 1'000'000));
  app.add_option("--housekeeping-seconds", options.interval, "time between two looks at what jobs take and what may go, s")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 86'400.0));
}

OperatingSettings operating_settings(const OperatingOptions& options, Settings& settings) {
  settings.quotas = Quotas(options.quotas);
  settings.disk_reserve = bytes_of_text(options.reserve);
  OperatingSettings operating;
  operating.metrics = options.metrics.empty() ? "unix:" + (settings.data / "metrics.sock").string() : options.metrics;
  operating.metrics_beyond_loopback = options.metrics_beyond_loopback;
  if (options.ended_days > 0) operating.retention.job_life = std::chrono::duration<double>(86400 * options.ended_days);
  operating.retention.checkpoints = options.ended_checkpoints;
  operating.interval = std::chrono::duration<double>(options.interval);
  return operating;
}

}  // namespace bedflow::server
