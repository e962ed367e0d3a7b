// The flags of bedflowd that say what its executors have.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>

#include "jobs.h"

namespace bedflow::server {

struct ExecutorFlags {
  bool slurm = false;
  SlurmSettings settings;
  double poll_seconds = 2;
  std::uint64_t memory_mib = 0;  // of this machine's jobs
};

void add_executor_flags(CLI::App& app, ExecutorFlags& flags, Settings& settings);
// Into the settings, after the command line has been read. Throws std::invalid_argument.
void take_executor_flags(const ExecutorFlags& flags, Settings& settings);

}  // namespace bedflow::server
