#include "executor_flags.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace bedflow::server {
namespace {

// What this machine has, or the control group that the server runs in allows.
std::uint64_t machine_memory_mib() {
  auto bytes = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
  double allowed = 0;  // "max" is no number
  if (std::ifstream("/sys/fs/cgroup/memory.max") >> allowed && allowed > 0) bytes = std::min(bytes, allowed);
  return static_cast<std::uint64_t>(bytes / (1 << 20));
}

}  // namespace

void add_executor_flags(CLI::App& app, ExecutorFlags& flags, Settings& settings) {
  constexpr double share = 0.9;  // the rest is the system's, the server's and the readers'
  settings.slots = std::max(4U, std::thread::hardware_concurrency());
  flags.memory_mib = static_cast<std::uint64_t>(share * static_cast<double>(machine_memory_mib()));
  app.add_option("--slots", settings.slots, "ranks that may run at once on this machine")
      ->capture_default_str()
      ->check(CLI::Range(1, 100'000));
  app.add_option("--memory-mib", flags.memory_mib,
                 "memory that the jobs on this machine may have together by their plans, MiB; 0: not counted")
      ->capture_default_str();
  auto* group = app.add_option_group("Slurm", "jobs on a cluster: submit --executor slurm");
  group->add_flag("--slurm", flags.slurm, "offer the executor slurm; DATA is on a file system that the nodes share");
  group
      ->add_option("--slurm-option", flags.settings.options, "given to sbatch, as in --slurm-option=--partition=long; repeatable")
      ->type_name("OPTION")
      ->allow_extra_args(false);
  group
      ->add_option("--slurm-launcher", flags.settings.launcher,
                   "starts engines of more than one rank: mpirun, or \"srun --mpi=pmix\"")
      ->capture_default_str();
  group
      ->add_option("--slurm-prologue", flags.settings.prologue, "shell lines that come first in each batch script: module load …")
      ->check(CLI::ExistingFile);
  group->add_option("--slurm-most-ranks", flags.settings.most_ranks, "ranks that one job may have")
      ->capture_default_str()
      ->check(CLI::Range(1, 100'000));
  group->add_flag("--slurm-memory", flags.settings.asks_for_memory,
                  "ask for --mem-per-cpu by the plan, a quarter more than it says");
  group->add_option("--slurm-poll-seconds", flags.poll_seconds, "between two looks at Slurm's queue while jobs are there, s")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 60.0));
}

void take_executor_flags(const ExecutorFlags& flags, Settings& settings) {
  settings.memory_bytes = static_cast<double>(flags.memory_mib) * (1 << 20);
  if (!flags.slurm) return;
  settings.slurm = flags.settings;
  settings.slurm->poll = std::chrono::milliseconds(static_cast<int>(std::lround(1000 * flags.poll_seconds)));
  if (settings.slurm->launcher.find_first_not_of(' ') == std::string::npos)
    throw std::invalid_argument("--slurm-launcher is empty; say e.g. mpirun");
}

}  // namespace bedflow::server
