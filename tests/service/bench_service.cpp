// The service's figures, a line each: name, value, unit, notes (tests/performance/figures.py reads them). Real server, real
// engine, real disk.
//
// usage: bench_service [submit|queue|statistics|watchers]...
#include <grpcpp/grpcpp.h>
#include <sched.h>
#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "bedflow/v1/results.pb.h"
#include "case_file.h"
#include "folder.h"
#include "process.h"
#include "record_log.h"
#include "support/server_process.h"
#include "watchers.h"

namespace bedflow::test {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

double milliseconds(Clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

double quantile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(part * static_cast<double>(values.size() - 1)));
}

void report(const std::string& name, double value, const std::string& unit, const std::string& notes) {
  std::printf("%s, %.6g, %s, %s\n", name.c_str(), value, unit.c_str(), notes.c_str());
  std::fflush(stdout);
}

std::string text_of(const char* format, double a, double b = 0) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), format, a, b);
  return text.data();
}

void must(const grpc::Status& status) {
  if (!status.ok()) throw std::runtime_error(status.error_message() + " " + detail_of(status).ShortDebugString());
}

v1::CreateJobRequest ready_case(const std::string& name) {
  const auto answer = server::ask({BEDFLOW_BIN_DIR "/bedflow", "init", name}, 10s, 1 << 20);
  v1::CreateJobRequest request;
  *request.mutable_case_() = read_case(answer.output).value;
  return request;
}

// A server of one slot, which an engine that has been stopped (SIGSTOP) takes up: what comes next waits.
class Bench {
 public:
  Bench() {
    const auto first = submit(server_.stub(), "bench-first");
    if (wait_for_state(server_.stub(), first, v1::RUNNING, 120s).state() != v1::RUNNING)
      throw std::runtime_error("no engine runs");
    for (const pid_t engine : server_.engines(first)) ::kill(engine, SIGSTOP);
  }
  ServerProcess& server() { return server_; }
  std::string submit(v1::JobService::Stub& stub, const std::string& request_id) const {
    auto request = request_;
    request.set_request_id(request_id);
    grpc::ClientContext context;
    v1::CreateJobResponse response;
    must(stub.CreateJob(&context, request, &response));
    return response.job().id();
  }

 private:
  v1::CreateJobRequest request_ = ready_case("mueller");
  TemporaryFolder folder_;
  ServerProcess server_{BEDFLOW_BIN_DIR "/bedflowd",
                        folder_.path() / "data",
                        BEDFLOW_BIN_DIR "/bedflow-engine",
                        {"--slots", "1", "--heartbeat-seconds", "3600"}};
};

void submit() {
  Bench bench;
  std::vector<double> times;
  for (int i = 0; i < 500; ++i) {
    const auto start = Clock::now();
    bench.submit(bench.server().stub(), "bench-one-" + std::to_string(i));
    times.push_back(milliseconds(Clock::now() - start));
  }
  report("service/submit/median", quantile(times, 0.5), "ms",
         text_of("90 %% within %.3g ms, 99 %% within %.3g ms", quantile(times, 0.9), quantile(times, 0.99)));
}

// 10 000 jobs by 16 clients; then their list, and a new server on them.
void queue() {
  constexpr int clients = 16, jobs = 10'000;
  Bench bench;
  const auto begin = Clock::now();
  std::vector<std::thread> threads;
  threads.reserve(clients);
  std::vector<double> times(jobs);
  for (int client = 0; client < clients; ++client) {
    threads.emplace_back([&, client] {
      const auto stub = v1::JobService::NewStub(bench.server().channel());
      for (int i = client; i < jobs; i += clients) {
        const auto start = Clock::now();
        bench.submit(*stub, "bench-many-" + std::to_string(i));
        times[static_cast<std::size_t>(i)] = milliseconds(Clock::now() - start);
      }
    });
  }
  for (auto& thread : threads) thread.join();
  const double seconds = milliseconds(Clock::now() - begin) / 1000;
  report("service/submit/sixteen_clients", jobs / seconds, "jobs/s",
         text_of("median %.3g ms, 99 %% within %.3g ms", quantile(times, 0.5), quantile(times, 0.99)));

  const auto first_page = [&](std::uint32_t size) {
    std::vector<double> pages;
    for (int i = 0; i < 20; ++i) {
      grpc::ClientContext context;
      v1::ListJobsRequest request;
      request.set_page_size(size);
      v1::ListJobsResponse response;
      const auto start = Clock::now();
      must(bench.server().stub().ListJobs(&context, request, &response));
      pages.push_back(milliseconds(Clock::now() - start));
    }
    return quantile(pages, 0.5);
  };
  report("service/list/first_page", first_page(50), "ms",
         text_of("50 of 10 000 jobs; 1000 of them in %.3g ms", first_page(1000)));

  std::vector<double> restarts;
  for (int i = 0; i < 5; ++i) {
    bench.server().kill();
    const auto start = Clock::now();
    bench.server().start();
    grpc::ClientContext context;
    v1::ServerInfo info;
    must(bench.server().stub().GetServerInfo(&context, {}, &info));
    restarts.push_back(milliseconds(Clock::now() - start) / 1000);
    if (info.jobs_pending() != jobs)
      throw std::runtime_error("the new server has " + std::to_string(info.jobs_pending()) + " jobs");
  }
  report("service/restart", quantile(restarts, 0.5), "s", "10 000 jobs, after a kill, until the first call is answered");
}

void statistics() {
  constexpr int samples = 1'000'000;
  Bench bench;
  const auto id = bench.submit(bench.server().stub(), "bench-statistics");
  const server::JobFolder folder(bench.server().folder(id));
  std::filesystem::create_directories(folder.root());
  {
    LogWriter log(folder.statistics());
    v1::StatisticsRecord record;
    auto& monitor = *record.mutable_schema()->add_monitors();
    monitor.set_name("height");
    monitor.set_unit("m");
    log.append(1, record.SerializeAsString());
    for (int i = 1; i <= samples; ++i) {
      auto& sample = *record.mutable_sample();
      sample.set_monitor(0);
      sample.set_step(static_cast<std::uint64_t>(i));
      sample.set_time(1e-4 * i);
      sample.set_value(0.1 + 1e-3 * (i % 977));
      log.append(1, record.SerializeAsString());
    }
  }
  const auto ask = [&] {
    grpc::ClientContext context;
    v1::QueryStatisticsRequest request;
    request.set_id(id);
    request.set_most(2000);
    v1::Statistics answer;
    const auto start = Clock::now();
    must(bench.server().stub().QueryStatistics(&context, request, &answer));
    const double time = milliseconds(Clock::now() - start);
    if (answer.series_size() != 1 || answer.series(0).value_size() < 1000) throw std::runtime_error("no series of samples");
    return time;
  };
  std::vector<double> firsts(5), times(9);
  for (double& first : firsts) {
    bench.server().kill();
    bench.server().start();
    first = ask();
  }
  report("service/statistics/million_first", quantile(firsts, 0.5), "ms", "of a server that has not read the log yet");
  for (double& time : times) time = ask();
  report("service/statistics/million", quantile(times, 0.5), "ms", "thinned to 2000");
}

// Threads that the process has now; later ones inherit it.
void pin(pid_t process, int core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core, &cores);
  for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    ::sched_setaffinity(std::stoi(thread.path().filename()), sizeof cores, &cores);
  }
}

// CPU time of a process, s.
double cpu_seconds(pid_t process) {
  clockid_t clock{};
  timespec time{};
  if (::clock_getcpuclockid(process, &clock) != 0 || ::clock_gettime(clock, &time) != 0) throw std::runtime_error("no CPU clock");
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// 1000 watchers, 100 of them frozen, on a bed at rest: what the engine's steps cost more, and the server's memory. The engine has
// a core of its own, server and watchers share another; CPU time, so that what else runs on the machine counts as little as it
// can.
void watchers() {
  TemporaryFolder folder;
  ServerProcess server(BEDFLOW_BIN_DIR "/bedflowd", folder.path() / "data", BEDFLOW_BIN_DIR "/bedflow-engine");
  auto request = ready_case("settling");
  request.mutable_case_()->mutable_time()->set_end(1000);
  request.mutable_case_()->clear_output();
  grpc::ClientContext context;
  v1::CreateJobResponse response;
  must(server.stub().CreateJob(&context, request, &response));
  const std::string id = response.job().id();
  if (wait_for_state(server.stub(), id, v1::RUNNING, 120s).state() != v1::RUNNING) throw std::runtime_error("no engine runs");
  const pid_t engine = server.engines(id).at(0);
  pin(engine, 0);
  pin(server.pid(), 1);
  pin(::getpid(), 1);
  std::uint64_t last = 0;
  // CPU time of a step over about so long, told by the engine's own progress.
  const auto cost = [&](std::chrono::seconds span) {
    double first_cpu = 0, cpu = 0;
    std::uint64_t first_step = 0, step = 0;
    const auto end = Clock::now() + span;
    const auto told = watch(
        server.stub(), id, last,
        [&](const v1::WatchJobResponse& one) {
          last = std::max<std::uint64_t>(last, one.sequence());
          if (!one.event().has_progress()) return false;
          step = one.event().progress().step();
          cpu = cpu_seconds(engine);
          if (first_step == 0) first_step = step, first_cpu = cpu;
          return Clock::now() > end;
        },
        span + 60s);
    return (cpu - first_cpu) / static_cast<double>(step - first_step);
  };
  cost(5s);  // comes to rest, and the replay of history is over
  std::vector<double> ratios;
  for (int pair = 0; pair < 8; ++pair) {
    const auto with = [&] {
      Watching crowd(server.address(), id, 1000, 100);
      if (!crowd.have_begun(60s)) throw std::runtime_error("not all watchers began");
      return cost(4s);
    };
    const bool with_first = pair % 2 == 0;  // what drifts cancels
    const double one = with_first ? with() : cost(4s), other = with_first ? cost(4s) : with();
    ratios.push_back(with_first ? one / other : other / one);
  }
  report("service/watchers/engine_cost", 100 * (quantile(ratios, 0.5) - 1), "% more CPU time a step with 1000 watchers",
         text_of("eight pairs, %.3g to %.3g %%", 100 * (quantile(ratios, 0) - 1), 100 * (quantile(ratios, 1) - 1)));
  const auto memory = server::read_text("/proc/" + std::to_string(server.pid()) + "/status");
  report("service/watchers/memory", std::stod(memory.substr(memory.find("VmHWM:") + 6)) / 1024, "MiB at most",
         "1000 watchers, 100 of them frozen");
}

}  // namespace
}  // namespace bedflow::test

int main(int argc, char** argv) {
  const std::map<std::string, std::function<void()>> parts = {{"submit", bedflow::test::submit},
                                                              {"queue", bedflow::test::queue},
                                                              {"statistics", bedflow::test::statistics},
                                                              {"watchers", bedflow::test::watchers}};
  std::vector<std::string> wanted(argv + 1, argv + argc);
  if (wanted.empty()) wanted = {"submit", "queue", "statistics", "watchers"};
  try {
    for (const auto& part : wanted) parts.at(part)();
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "bench_service: %s\n", failure.what());
    return 1;
  }
  return 0;
}
