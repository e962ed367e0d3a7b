// Why a run stops before its end. The numbers are the exit codes of bedflow-engine and StopReason in job.proto
// (report/ checks that they agree).
#pragma once

#include <stdexcept>
#include <string>

namespace bedflow {

enum class Reason {
  finished = 0,
  suspended = 3,
  cancelled = 4,
  invalid_case = 10,
  diverged = 11,
  not_converged = 12,
  particle_lost = 13,
  out_of_memory = 14,
  disk_full = 15,
  wall_limit = 18,
  checkpoint_corrupt = 20,
  stale_epoch = 22,
  folder_removed = 23,
  internal = 70,
};

// Thrown where all ranks know of it alike, or before the ranks have anything in common to do. A failure that one rank
// alone has seen is kept as a Failure and voted on at the end of the step.
class Stop : public std::runtime_error {
 public:
  Stop(Reason why, const std::string& message) : std::runtime_error(message), reason(why) {}
  Reason reason;
};

// The first failure that this rank has seen in the present step.
struct Failure {
  Reason reason = Reason::finished;
  std::string message;

  explicit operator bool() const { return reason != Reason::finished; }
  void note(Reason why, const std::string& what) {
    if (!*this) *this = {why, what};
  }
};

}  // namespace bedflow
