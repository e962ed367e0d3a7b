#include "runner.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <thread>
#include <vector>

#include "folder.h"
#include "process.h"

namespace bedflow::server {
namespace {

constexpr int taken_code = 75;          // EX_TEMPFAIL
constexpr int cannot_start_code = 127;  // as a shell says it

// Left open on purpose: the lock lives as long as anyone who has inherited it.
bool take_lock(const JobFolder& folder, std::uint32_t epoch) {
  const int lock = ::open(folder.lock(epoch).c_str(), O_RDWR | O_CREAT, 0600);
  return lock >= 0 && ::flock(lock, LOCK_EX | LOCK_NB) == 0;
}

Launch engine_launch(const RunnerOptions& options) {
  Launch launch;
  if (options.ranks > 1) {
    launch.command = {options.mpirun, "-n", std::to_string(options.ranks), "--oversubscribe", "--bind-to", "none"};
    launch.environment = {"OMPI_ALLOW_RUN_AS_ROOT=1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1"};
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
  for (const auto& word : command) *runner.mutable_command() += (runner.command().empty() ? "" : " ") + word;
  write_durably(folder.runner(options.epoch), runner);
}

void write_exit(const JobFolder& folder, std::uint32_t epoch, int exit_code) {
  v1::ExitRecord record;
  record.set_epoch(epoch);
  record.set_exit_code(exit_code);
  if (exit_code > 128) record.set_signal(exit_code - 128);
  record.set_unix_nanos(std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count());
  write_durably(folder.exit_record(epoch), record);
}

}  // namespace

int run_attempt(const RunnerOptions& options) {
  const JobFolder folder(options.folder);
  if (options.lock_descriptor >= 0) {
    ::close_range(static_cast<unsigned>(options.lock_descriptor) + 1, ~0U, 0);  // nothing else of the server's stays open
  } else {
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
  if (std::filesystem::exists(folder.runner(options.epoch))) {
    std::fprintf(stderr, "attempt %u of %s has been run already\n", options.epoch, options.folder.c_str());
    return taken_code;
  }
  const Launch engine = engine_launch(options);
  write_runner(folder, options, engine.command);
  int exit_code = cannot_start_code;
  try {
    exit_code = wait_for_exit(launch(engine));
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "%s\n", failure.what());
  }
  write_exit(folder, options.epoch, exit_code);
  return exit_code;
}

}  // namespace bedflow::server
