// bedflowd: the server; and, as `bedflowd run-attempt`, the runner of one attempt (runner.h).
#include <grpcpp/grpcpp.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>
#include <thread>

#include "backup.h"
#include "executor_flags.h"
#include "housekeeping.h"
#include "jobs.h"
#include "listen.h"
#include "log_format.h"
#include "operating_options.h"
#include "runner.h"
#include "security.h"
#include "service.h"
#include "size_text.h"
#include "studies.h"
#include "tokens.h"
#include "watch.h"

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

struct Options {
  Settings settings;
  ExecutorFlags executors;
  Listening listening;
  OperatingOptions operating;
  bool idle_exit = false;
  double idle_seconds = 10;
  double bookmark_seconds = 10;
  double heartbeat_seconds = 30;
  ReaderSettings reader;
  std::uint32_t reader_seconds = 60;
};

// One server a data folder. Kept until the process ends.
void take_folder(const fs::path& data) {
  const int lock = ::open((data / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock < 0) throw std::system_error(errno, std::generic_category(), (data / "lock").string());
  // A server that was killed while it started a process leaves the lock to that one until it has begun: moments.
  const auto deadline = std::chrono::steady_clock::now() + 2s;
  while (::flock(lock, LOCK_EX | LOCK_NB) != 0) {
    if (std::chrono::steady_clock::now() > deadline) throw std::runtime_error("another bedflowd serves " + data.string());
    std::this_thread::sleep_for(10ms);
  }
}

// A round that fails (on a full disk, say) is tried again a second later.
void supervise(const std::function<void()>& round, const std::atomic<bool>& ending) {
  while (!ending) {
    try {
      round();
    } catch (const std::exception& failure) {
      spdlog::error("{}", failure.what());
      std::this_thread::sleep_for(1s);
    }
  }
}

// Until a signal asks to end, or nothing has been going on for so long.
void wait_for_end(const sigset_t& signals, const std::function<bool()>& has_nothing_to_do) {
  const timespec moment{0, 200'000'000};
  while (::sigtimedwait(&signals, nullptr, &moment) < 0) {
    if (has_nothing_to_do()) return;
  }
}

// Tells the log, and whoever has started the server. Returns the addresses in one line.
std::string announce(const Options& options, const std::vector<std::string>& addresses, const Tokens& tokens) {
  std::string all;
  for (const auto& address : addresses) {
    all += (all.empty() ? "" : ", ") + address;
    spdlog::info("bedflowd " BEDFLOW_VERSION " serves {} on {} with {} slots", options.settings.data.string(), address,
                 options.settings.slots);
    std::printf("listening on %s\n", address.c_str());
  }
  std::fflush(stdout);
  if (options.listening.has_network() && tokens.empty())
    spdlog::info("there are no tokens yet: bedflow server token create OWNER --scope submit --out FILE --server {}",
                 *std::ranges::find_if(addresses, [](const auto& address) { return address.starts_with("unix:"); }));
  return all;
}

[[noreturn]] void serve(Options& options) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // all threads inherit it
  ::signal(SIGPIPE, SIG_IGN);
  ::umask(0077);

  const fs::path& data = options.settings.data;
  if (options.listening.tls.given()) require_sound(options.listening.tls);
  for (const auto& wanted : options.listening.wanted) {  // before a folder is made for a server that will not come up
    if (!wanted.starts_with("unix:")) listen_address(wanted, options.listening.has_network());
  }
  make_private(data);
  take_folder(data);
  auto listened = addresses(options.listening, data);
  Tokens tokens(data / "tokens.txtpb");
  const Door door(tokens, options.listening.has_network());
  const auto operating = operating_settings(options.operating, options.settings);
  Jobs jobs(options.settings);
  Studies studies(jobs, data / "studies");
  Watchers watchers(std::chrono::milliseconds(static_cast<int>(1000 * options.bookmark_seconds)));
  Readers readers(options.reader);
  Housekeeping housekeeping(jobs, readers, operating);
  JobService service(jobs, studies, watchers, readers, housekeeping, options.settings.programs.engine, door, tokens);
  const auto server = listen(options.listening, listened, service, door, tokens, housekeeping.calls());
  housekeeping.start([&] { return std::pair(watchers.count(), service.calls()); }, [&] { return studies.jobs(); });
  service.set_addresses(announce(options, listened, tokens));

  std::atomic<bool> ending = false;
  auto last_round = std::chrono::steady_clock::now();
  const auto attend_jobs = [&] {
    watchers.wake(jobs.advance());
    if (std::chrono::steady_clock::now() - last_round < 500ms) return;
    last_round = std::chrono::steady_clock::now();
    watchers.wake_all();
  };
  const auto attend_studies = [&] {
    studies.advance();
    std::this_thread::sleep_for(500ms);
  };
  std::thread supervisor([&] { supervise(attend_jobs, ending); });
  std::thread study_supervisor([&] { supervise(attend_studies, ending); });
  const std::chrono::duration<double> patience(options.idle_seconds);
  wait_for_end(signals, [&] {
    return options.idle_exit && service.quiet() > patience && service.calls() + watchers.count() == 0 && jobs.is_idle() &&
           studies.is_idle();
  });
  spdlog::info("going down; what runs goes on running");
  watchers.drain();
  service.drain();
  jobs.stop_waiting();
  // Idle connections are not waited for, only calls.
  const auto deadline = std::chrono::steady_clock::now() + 2s;
  while (service.calls() + watchers.count() > 0 && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(5ms);
  server->Shutdown(std::chrono::system_clock::now() + 50ms);
  ending = true;
  jobs.poke();
  supervisor.join();
  study_supervisor.join();
  housekeeping.stop();
  service.wait_for_calls();
  // gRPC's own end may wait 10 s for a poller of a connection that is gone. All that lasts is on the disk.
  spdlog::shutdown();
  std::_Exit(0);
}

fs::path own_path() {
  return fs::read_symlink("/proc/self/exe");
}

void add_server_options(CLI::App& app, Options& options) {
  Settings& settings = options.settings;
  settings.programs.server = own_path();
  settings.programs.engine = own_path().parent_path() / "bedflow-engine";
  options.reader.program = own_path().parent_path() / "bedflow-reader";
  app.add_option("--data", settings.data, "folder of the jobs and their catalogue; made private (mode 0700)");
  auto& listening = options.listening;
  app.add_option("--listen", listening.wanted,
                 "unix:PATH, 127.0.0.1:PORT, or with TLS HOST:PORT; unix:DATA/bedflowd.sock if absent")
      ->type_name("ADDRESS")
      ->allow_extra_args(false);
  app.add_option("--tls-certificate", listening.tls.certificate, "the server's certificate, PEM; callers over TLS need tokens")
      ->type_name("FILE");
  app.add_option("--tls-key", listening.tls.key, "its private key, PEM")->type_name("FILE");
  app.add_option("--client-ca", listening.tls.client_ca, "clients need certificates of this authority too, PEM")
      ->type_name("FILE");
  app.add_option("--engine", settings.programs.engine, "the engine")->capture_default_str();
  app.add_option("--reader", options.reader.program, "opens checkpoints")->capture_default_str();
  app.add_option("--reader-memory-mib", options.reader.memory_mib, "memory that one question about a checkpoint may take, MiB")
      ->capture_default_str()
      ->check(CLI::Range(64, 1 << 30));
  app.add_option("--reader-seconds", options.reader_seconds, "time that one question about a checkpoint may take, s")
      ->capture_default_str()
      ->check(CLI::Range(1, 86'400));
  app.add_option("--mpirun", settings.programs.mpirun, "starts engines of more than one rank")->capture_default_str();
  app.add_flag("--idle-exit", options.idle_exit, "end when no job waits or runs and no call has come for a while");
  app.add_option("--idle-seconds", options.idle_seconds, "that while, s")->capture_default_str()->check(CLI::Range(0.1, 1e6));
  app.add_option("--bookmark-seconds", options.bookmark_seconds, "silence after which a watcher hears a bookmark, s")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 15.0));
  app.add_option("--heartbeat-seconds", options.heartbeat_seconds, "silence of an engine after which it is given up, s")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 3600.0));
  add_executor_flags(app, options.executors, settings);
}

struct BackupOptions {
  fs::path data, to;
};

CLI::App* add_backup(CLI::App& app, BackupOptions& options) {
  auto* command = app.add_subcommand("backup", "copy a data folder so that a server can go on from the copy; the server may run");
  command->add_option("--data", options.data, "the data folder")->required();
  command->add_option("--to", options.to, "folder of the copy: new, or an earlier one that is brought up to date")->required();
  return command;
}

int copy_data(const BackupOptions& options) {
  const auto report = back_up(options.data, options.to);
  std::printf("%llu jobs; %llu files that were new or had changed, %s, copied to %s\n",
              static_cast<unsigned long long>(report.jobs), static_cast<unsigned long long>(report.files),
              bytes_text(report.bytes).c_str(), options.to.c_str());
  return 0;
}

CLI::App* add_runner(CLI::App& app, RunnerOptions& runner) {
  auto* command = app.add_subcommand("run-attempt", "run one attempt of a job, without a server")->group("");
  command->add_option("folder", runner.folder)->required();
  command->add_option("epoch", runner.epoch)->required();
  command->add_option("--engine", runner.engine)->required();
  command->add_option("--mpirun", runner.mpirun);
  command->add_option("--ranks", runner.ranks)->check(CLI::Range(1, 100'000));
  command->add_option("--from", runner.from_step);
  command->add_option("--launcher", runner.launcher);
  command->add_option("--batch-job", runner.batch_job);
  command->add_option("--lock-descriptor", runner.lock_descriptor);
  return command;
}

int run(int argc, char** argv) {
  CLI::App app("bedflowd " BEDFLOW_VERSION ": the server of bedflow. Starts engines, and never takes one down with it.");
  app.set_version_flag("--version", BEDFLOW_VERSION);
  Options options;
  RunnerOptions runner;
  BackupOptions backup;
  add_server_options(app, options);
  add_operating_options(app, options.operating);
  const auto* backing_up = add_backup(app, backup);
  const auto* attempt = add_runner(app, runner);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (attempt->parsed()) return run_attempt(runner);
  if (backing_up->parsed()) return copy_data(backup);
  set_up_log(options.operating.log);
  if (options.settings.data.empty())
    throw std::invalid_argument("--data is missing: the folder of the jobs, e.g. --data ./bedflow-data");
  options.settings.data = fs::absolute(options.settings.data).lexically_normal();
  take_executor_flags(options.executors, options.settings);
  options.reader.time = std::chrono::seconds(options.reader_seconds);
  options.settings.heartbeat_limit = std::chrono::seconds(static_cast<int>(options.heartbeat_seconds));
  serve(options);
}

}  // namespace
}  // namespace bedflow::server

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("bedflowd"));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  try {
    return bedflow::server::run(argc, argv);
  } catch (const std::invalid_argument& wrong) {
    std::fprintf(stderr, "bedflowd: %s\n", wrong.what());
    return 2;
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "bedflowd: %s\n", failure.what());
    return 1;
  }
}
