// Starts and ends attempts on this machine. An attempt is a runner in its own session, with the engine's processes below it.
//
// The lock of an attempt is taken before the runner exists and handed down to it and to what it starts: a job never has two live
// attempts, whatever is killed when.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "folder.h"

namespace bedflow::server {

struct Programs {
  std::filesystem::path server;  // this program: it is the runner too
  std::filesystem::path engine;
  std::string mpirun = "mpirun";
};

class LocalExecutor {
 public:
  explicit LocalExecutor(Programs programs) : programs_(std::move(programs)) {}

  // from_step: the checkpoint to take up; the newest good one if absent. Throws std::runtime_error when an earlier attempt still
  // lives or the runner cannot be started.
  void start(const JobFolder& folder, std::uint32_t epoch, std::uint32_t ranks, std::optional<std::uint64_t> from_step);
  bool is_alive(const JobFolder& folder, std::uint32_t epoch) const;
  void kill(const JobFolder& folder, std::uint32_t epoch) const;  // SIGKILL to all of the attempt's session
  void reap();                                                    // children of ours that have ended

 private:
  Programs programs_;
  std::vector<pid_t> runners_;  // started by this server
};

}  // namespace bedflow::server
