// A job folder from where it stands to its end: steps, statistics, checkpoints, the vote on stopping.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "base/stop.h"
#include "parallel/comm.h"

namespace bedflow {

struct RunOptions {
  std::filesystem::path folder;
  std::uint32_t epoch = 0;            // attempt that this process belongs to; 0: none
  std::optional<std::uint64_t> from;  // step of the checkpoint to go on from; the newest good one if absent
};

// Collective. Runs until the end, a command, a signal (SIGUSR1: checkpoint; SIGTERM, SIGINT: checkpoint and stop) or a failure.
// Writes everything that the job folder promises, the last event and summary.json included, and says why it stopped.
Reason run(const Comm& comm, const RunOptions& options);

}  // namespace bedflow
