// `bedflowd run-attempt FOLDER EPOCH`: one attempt of a job, independent of the server; on this machine, or as a batch system's
// script. Claims the attempt, holds its lock, writes runner.txtpb, starts the engine (by mpirun when there is more than one
// rank), waits, writes exit.txtpb. Of SIGUSR1 (a batch system's: the time is nearly over) it makes the command that has the
// engine write a checkpoint and stop with WALL_LIMIT; SIGTERM is the engine's business.
//
// The claim is a file that only one process can create (`taken`): of two runners of an attempt, on whatever nodes, one goes on.
// The lock says that somebody lives, on this machine; locks of a shared file system are not relied on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace bedflow::server {

struct RunnerOptions {
  std::filesystem::path folder;
  std::uint32_t epoch = 0;
  std::filesystem::path engine;
  std::string mpirun = "mpirun";
  std::uint32_t ranks = 1;
  std::optional<std::uint64_t> from_step;  // the newest good checkpoint if absent
  int lock_descriptor = -1;                // the attempt's lock, already held; taken here if absent
  std::string launcher;                    // a batch system's: words before -n RANKS ENGINE, instead of mpirun and its options
  std::string batch_job;                   // its number of this attempt
};

// The engine's exit code; 75 when the attempt is or was run by another runner, or a later attempt exists.
int run_attempt(const RunnerOptions& options);

}  // namespace bedflow::server
