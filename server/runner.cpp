#include "runner.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <exception>
#include <iterator>
#include <sstream>
#include <system_error>
#include <thread>
#include <vector>

#include "attempt.h"
#include "clock.h"
#include "folder.h"
#include "process.h"

namespace bedflow::server {
namespace {

using namespace std::chrono_literals;

constexpr int taken_code = 75;          // EX_TEMPFAIL
constexpr int cannot_start_code = 127;  // as a shell says it

// Left open on purpose: the lock lives as long as anyone who has inherited it.
bool take_lock(const JobFolder& folder, std::uint32_t epoch) {
  const int lock = ::open(folder.lock(epoch).c_str(), O_RDWR | O_CREAT, 0600);
  return lock >= 0 && ::flock(lock, LOCK_EX | LOCK_NB) == 0;
}

// False: another runner has been here, whether it lives or not.
bool claim(const JobFolder& folder, std::uint32_t epoch) {
  const int file = ::open(folder.taken(epoch).c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file < 0 && errno != EEXIST) throw std::system_error(errno, std::generic_category(), folder.taken(epoch).string());
  if (file >= 0) ::close(file);
  return file >= 0;
}

// On another node the engine of an attempt that has been given up may not have noticed yet. False: it never does.
bool wait_for_earlier(const JobFolder& folder, std::uint32_t epoch) {
  constexpr auto stillness = 3s, patience = 60s;
  const auto epochs = folder.epochs();
  const bool all_told = std::all_of(epochs.begin(), epochs.end(), [&](std::uint32_t one) {
    return one >= epoch || !std::filesystem::exists(folder.taken(one)) || std::filesystem::exists(folder.exit_record(one));
  });
  if (all_told) return true;
  const auto begin = std::chrono::steady_clock::now();
  auto changed = begin;
  for (std::string last = heartbeat_of(folder); std::chrono::steady_clock::now() - changed < stillness;) {
    if (std::chrono::steady_clock::now() - begin > patience) return false;
    std::this_thread::sleep_for(100ms);
    if (auto beat = heartbeat_of(folder); beat != last) {
      last = std::move(beat);
      changed = std::chrono::steady_clock::now();
    }
  }
  return true;
}

Launch engine_launch(const RunnerOptions& options) {
  Launch launch;
  if (options.ranks > 1) launch.environment = {"OMPI_ALLOW_RUN_AS_ROOT=1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1"};
  if (options.ranks > 1 && !options.launcher.empty()) {
    std::istringstream words(options.launcher);
    launch.command.assign(std::istream_iterator<std::string>(words), {});
    launch.command.insert(launch.command.end(), {"-n", std::to_string(options.ranks)});
  } else if (options.ranks > 1) {
    launch.command = {options.mpirun, "-n", std::to_string(options.ranks), "--oversubscribe", "--bind-to", "none"};
    // Ranks that fill the machine leave it to others while they wait; a core to spare would make this a loss.
    if (options.ranks >= std::thread::hardware_concurrency()) launch.environment.emplace_back("OMPI_MCA_mpi_yield_when_idle=1");
  }
  launch.command.insert(launch.command.end(), {options.engine, options.folder, "--epoch", std::to_string(options.epoch)});
  if (options.from_step) launch.command.insert(launch.command.end(), {"--from", std::to_string(*options.from_step)});
  launch.output = STDOUT_FILENO;
  launch.error = STDERR_FILENO;
  return launch;
}

void write_runner(const JobFolder& folder, const RunnerOptions& options, const std::vector<std::string>& command) {
  v1::Runner runner;
  runner.set_pid(::getpid());
  runner.set_start_ticks(start_ticks(::getpid()).value_or(0));
  runner.set_epoch(options.epoch);
  runner.set_host(host_name());
  if (!options.batch_job.empty()) runner.set_batch_job(options.batch_job);
  for (const auto& word : command) *runner.mutable_command() += (runner.command().empty() ? "" : " ") + word;
  write_durably(folder.runner(options.epoch), runner);
}

void write_exit(const JobFolder& folder, std::uint32_t epoch, int exit_code) {
  v1::ExitRecord record;
  record.set_epoch(epoch);
  record.set_exit_code(exit_code);
  if (exit_code > 128) record.set_signal(exit_code - 128);
  record.set_unix_nanos(now_nanos());
  write_durably(folder.exit_record(epoch), record);
}

sigset_t runner_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGCHLD, SIGUSR1, SIGTERM}) sigaddset(&signals, signal);
  return signals;
}

// The exit code. The signals are blocked.
int wait_for_engine(pid_t engine, const JobFolder& folder) {
  const sigset_t signals = runner_signals();
  const timespec moment{1, 0};  // for a parent that has SIGCHLD ignored: then none comes
  int status = 0;
  while (::waitpid(engine, &status, WNOHANG) == 0) {
    if (::sigtimedwait(&signals, nullptr, &moment) != SIGUSR1) continue;
    try {
      std::fprintf(stderr, "the time is nearly over: the engine is told to write a checkpoint and stop\n");
      folder.command(v1::Control::LIMIT);
    } catch (const std::exception& failure) {
      std::fprintf(stderr, "%s\n", failure.what());
    }
  }
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace

int run_attempt(const RunnerOptions& options) {
  const JobFolder folder(options.folder);
  if (options.lock_descriptor >= 0) {
    ::close_range(static_cast<unsigned>(options.lock_descriptor) + 1, ~0U, 0);  // nothing else of the server's stays open
  } else {
    if (!std::filesystem::exists(folder.case_file())) {  // deleted, say, while it waited in a batch system's queue
      std::fprintf(stderr, "%s is no job's folder\n", options.folder.c_str());
      return taken_code;
    }
    std::filesystem::create_directories(folder.attempt(options.epoch));
    if (!take_lock(folder, options.epoch)) {
      std::fprintf(stderr, "attempt %u of %s is run by another runner\n", options.epoch, options.folder.c_str());
      return taken_code;
    }
  }
  if (const auto epochs = folder.epochs(); !epochs.empty() && epochs.back() > options.epoch) {
    std::fprintf(stderr, "attempt %u of %s has been replaced by attempt %u\n", options.epoch, options.folder.c_str(),
                 epochs.back());
    return taken_code;
  }
  // Also when the first runner and all that it started are gone: what they left behind is taken up by an attempt of its own.
  if (!claim(folder, options.epoch)) {
    std::fprintf(stderr, "attempt %u of %s has been run already\n", options.epoch, options.folder.c_str());
    return taken_code;
  }
  const sigset_t signals = runner_signals();
  ::sigprocmask(SIG_BLOCK, &signals, nullptr);
  const Launch engine = engine_launch(options);
  write_runner(folder, options, engine.command);
  int exit_code = cannot_start_code;
  try {
    if (options.batch_job.empty() || wait_for_earlier(folder, options.epoch)) {
      exit_code = wait_for_engine(launch(engine), folder);
    } else {
      std::fprintf(stderr, "an earlier attempt still runs and does not heed this one\n");
      exit_code = v1::BACKEND_ERROR;
    }
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "%s\n", failure.what());
  }
  write_exit(folder, options.epoch, exit_code);
  return exit_code;
}

}  // namespace bedflow::server
