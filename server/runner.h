// `bedflowd run-attempt FOLDER EPOCH`: one attempt of a job, independent of the server. Holds the attempt's lock, writes
// runner.txtpb, starts the engine (by mpirun when there is more than one rank), waits, writes exit.txtpb.
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
};

// The engine's exit code; 75 when the attempt is or was run by another runner, or a later attempt exists.
int run_attempt(const RunnerOptions& options);

}  // namespace bedflow::server
