#include "metrics.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "states.h"

namespace bedflow::server {
namespace {

using Type = MetricsText::Type;

const char* code_name(grpc::StatusCode code) {
  static constexpr std::array<const char*, 17> names = {
      "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
      "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
      "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
      "DATA_LOSS", "UNAUTHENTICATED"};
  const auto number = static_cast<std::size_t>(code);
  return number < names.size() ? names[number] : "UNKNOWN";
}

class Metering final : public grpc::experimental::Interceptor {
 public:
  Metering(CallMeter& meter, std::string method, bool timed) : meter_(meter), method_(std::move(method)), timed_(timed) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using Point = grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(Point::PRE_SEND_STATUS))
      meter_.count(method_, methods->GetSendStatus().error_code(), std::chrono::steady_clock::now() - begin_, timed_);
    methods->Proceed();
  }

 private:
  CallMeter& meter_;
  const std::string method_;
  const bool timed_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

std::string escaped(const std::string& value) {
  std::string text;
  for (const char c : value) {
    if (c == '\\' || c == '"') text += '\\';
    text += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return text;
}

// Fields of /proc/self/stat behind the program's name, from the third on.
std::vector<std::string> own_stat() {
  std::ifstream file("/proc/self/stat");
  std::string text{std::istreambuf_iterator<char>(file), {}};
  std::istringstream words(text.substr(text.rfind(')') + 1));
  return {std::istream_iterator<std::string>(words), {}};
}

void add_process(MetricsText& metrics) {
  const auto stat = own_stat();
  if (stat.size() < 22) return;
  const auto ticks = static_cast<double>(::sysconf(_SC_CLK_TCK));
  const auto page = static_cast<double>(::sysconf(_SC_PAGESIZE));
  metrics.one("process_cpu_seconds_total", Type::counter, "CPU time of the server, s",
              (std::stod(stat[11]) + std::stod(stat[12])) / ticks);
  metrics.one("process_resident_memory_bytes", Type::gauge, "Memory of the server", std::stod(stat[21]) * page);
  std::error_code none;
  const std::filesystem::directory_iterator files("/proc/self/fd", none);
  metrics.one("process_open_fds", Type::gauge, "Open files of the server",
              static_cast<double>(std::distance(begin(files), end(files))));
}

void add_jobs(MetricsText& metrics, const Figures& jobs) {
  metrics.begin("bedflow_jobs", Type::gauge, "Jobs that are kept, by state");
  for (int state = v1::PENDING; state <= v1::FAILED; ++state) {
    const auto found = jobs.jobs.find(static_cast<v1::JobState>(state));
    metrics.add({{"state", state_word(static_cast<v1::JobState>(state))}},
                found == jobs.jobs.end() ? 0 : static_cast<double>(found->second));
  }
  metrics.begin("bedflow_job_transitions_total", Type::counter, "Jobs that have come into a state since the server began");
  for (const auto& [state, count] : jobs.entered) metrics.add({{"state", state_word(state)}}, static_cast<double>(count));
  metrics.begin("bedflow_attempt_failures_total", Type::counter, "Attempts that ended by a failure since the server began");
  for (const auto& [reason, count] : jobs.failures)
    metrics.add({{"reason", v1::StopReason_Name(reason)}}, static_cast<double>(count));
  metrics.one("bedflow_ranks_in_use", Type::gauge, "Ranks that run", jobs.ranks_in_use);
  metrics.one("bedflow_ranks_limit", Type::gauge, "Ranks that may run at once", jobs.slots);
  const auto of_job = [](const v1::Job& job) {
    return MetricsText::Labels{{"job", job.id()}, {"case", job.case_name()}, {"owner", job.owner()}};
  };
  metrics.begin("bedflow_job_progress_ratio", Type::gauge, "Simulated time of a running job over its end time");
  for (const auto& job : jobs.live) {
    if (job.progress().end_time() > 0) metrics.add(of_job(job), job.progress().time() / job.progress().end_time());
  }
  metrics.begin("bedflow_job_eta_seconds", Type::gauge, "Wall time that a running job still takes, s");
  for (const auto& job : jobs.live) {
    if (job.progress().has_eta_seconds()) metrics.add(of_job(job), job.progress().eta_seconds());
  }
  metrics.begin("bedflow_job_memory_bytes", Type::gauge, "Memory of a running job on this machine");
  for (const auto& job : jobs.live) metrics.add(of_job(job), static_cast<double>(job.memory_bytes()));
}

void add_disk(MetricsText& metrics, const MetricsSources& sources) {
  metrics.one("bedflow_disk_free_bytes", Type::gauge, "Free on the disk of the jobs",
              static_cast<double>(sources.jobs.disk_free));
  metrics.one("bedflow_disk_reserve_bytes", Type::gauge, "No job starts while less is free",
              static_cast<double>(sources.jobs.disk_reserve));
  metrics.begin("bedflow_disk_used_bytes", Type::gauge, "Disk that the jobs of an owner take");
  for (const auto& owner : sources.usage.owners()) metrics.add({{"owner", owner.owner()}}, static_cast<double>(owner.bytes()));
  double checkpoints = 0;
  for (const auto& job : sources.usage.jobs()) checkpoints += static_cast<double>(job.checkpoint_bytes());
  metrics.one("bedflow_checkpoint_bytes", Type::gauge, "Disk that checkpoints take", checkpoints);
  metrics.begin("bedflow_rank_seconds", Type::gauge, "Ranks × wall time of the jobs that are kept, s");
  for (const auto& owner : sources.usage.owners()) metrics.add({{"owner", owner.owner()}}, owner.rank_seconds());
  metrics.one("bedflow_retention_removed_jobs_total", Type::counter, "Jobs that retention has removed",
              static_cast<double>(sources.removed.jobs));
  metrics.one("bedflow_retention_removed_checkpoints_total", Type::counter, "Checkpoints that retention has removed",
              static_cast<double>(sources.removed.checkpoints));
  metrics.one("bedflow_retention_removed_bytes_total", Type::counter, "Disk that retention has freed",
              static_cast<double>(sources.removed.bytes));
}

void add_calls(MetricsText& metrics, const CallMeter& calls) {
  metrics.begin("bedflow_calls_total", Type::counter, "Calls that have ended, by method and status");
  for (const auto& [key, count] : calls.counts())
    metrics.add({{"method", key.first}, {"code", key.second}}, static_cast<double>(count));
  metrics.begin("bedflow_call_seconds", Type::histogram, "Time to the answer of calls that do not stream, s");
  for (const auto& [method, times] : calls.times()) {
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < CallMeter::bounds.size(); ++i) {
      below += times.buckets[i];
      std::ostringstream bound;
      bound << CallMeter::bounds[i];
      metrics.add({{"method", method}, {"le", bound.str()}}, static_cast<double>(below), "_bucket");
    }
    below += times.buckets.back();
    metrics.add({{"method", method}, {"le", "+Inf"}}, static_cast<double>(below), "_bucket");
    metrics.add({{"method", method}}, times.sum, "_sum");
    metrics.add({{"method", method}}, static_cast<double>(below), "_count");
  }
}

}  // namespace

void CallMeter::count(const std::string& method, grpc::StatusCode code, std::chrono::duration<double> time, bool timed) {
  const std::lock_guard guard(mutex_);
  ++counts_[{method, code_name(code)}];
  if (!timed) return;
  Times& times = times_[method];
  ++times.buckets[static_cast<std::size_t>(std::lower_bound(bounds.begin(), bounds.end(), time.count()) - bounds.begin())];
  times.sum += time.count();
}

std::map<std::pair<std::string, std::string>, std::uint64_t> CallMeter::counts() const {
  const std::lock_guard guard(mutex_);
  return counts_;
}

std::map<std::string, CallMeter::Times> CallMeter::times() const {
  const std::lock_guard guard(mutex_);
  return times_;
}

grpc::experimental::Interceptor* CallMeterFactory::CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) {
  const std::string method = info->method() ? info->method() : "", ours = "/bedflow.v1.JobService/";
  if (!method.starts_with(ours)) return nullptr;  // health and reflection
  const bool streams = info->type() != grpc::experimental::ServerRpcInfo::Type::UNARY;
  return new Metering(meter_, method.substr(ours.size()), !streams);
}

void MetricsText::begin(const std::string& name, Type type, const std::string& help) {
  name_ = name;
  const char* word = type == Type::gauge ? "gauge" : type == Type::counter ? "counter" : "histogram";
  text_ += "# HELP " + name + " " + help + "\n# TYPE " + name + " " + word + "\n";
}

void MetricsText::add(const Labels& labels, double value, const std::string& suffix) {
  text_ += name_ + suffix;
  for (std::size_t i = 0; i < labels.size(); ++i)
    text_ += (i == 0 ? "{" : ",") + labels[i].first + "=\"" + escaped(labels[i].second) + "\"";
  std::array<char, 40> number{};
  std::snprintf(number.data(), number.size(), "%.17g", value);
  text_ += (labels.empty() ? " " : "} ") + std::string(number.data()) + "\n";
}

void MetricsText::one(const std::string& name, Type type, const std::string& help, double value) {
  begin(name, type, help);
  add({}, value);
}

std::string metrics_text(const MetricsSources& sources, const CallMeter& calls) {
  MetricsText metrics;
  metrics.begin("bedflow_build_info", Type::gauge, "1, with the version of the server");
  metrics.add({{"version", BEDFLOW_VERSION}}, 1);
  add_jobs(metrics, sources.jobs);
  add_disk(metrics, sources);
  metrics.one("bedflow_watchers", Type::gauge, "Streams that follow jobs", static_cast<double>(sources.watchers));
  metrics.one("bedflow_calls_in_progress", Type::gauge, "Calls that are being answered", static_cast<double>(sources.calls));
  add_calls(metrics, calls);
  add_process(metrics);
  return metrics.text();
}

}  // namespace bedflow::server
