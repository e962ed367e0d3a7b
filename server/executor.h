// What runs the attempts at jobs: this machine (local_executor.h), or a batch system (slurm_executor.h). Whichever it is, an
// attempt is `bedflowd run-attempt` (runner.h) on the job's folder; the folder tells what the engine does, the executor only
// whether it is there.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "folder.h"
#include "states.h"

namespace bedflow::server {

struct Programs {
  std::filesystem::path server;  // this program: it is the runner too
  std::filesystem::path engine;
  std::string mpirun = "mpirun";
};

// What an attempt is to be.
struct AttemptOrder {
  std::uint32_t epoch = 0;
  std::uint32_t ranks = 1;
  std::optional<std::uint64_t> from_step;       // the checkpoint to take up; the newest good one if absent
  std::chrono::duration<double> wall_limit{0};  // none if 0
  std::chrono::duration<double> step_time{0};   // of one step of the engine, by its plan
  double memory_bytes = 0;                      // of all ranks together, by the plan; 0: not known
  double checkpoint_bytes = 0;                  // likewise
};

// What an executor knows of an attempt.
struct Sighting {
  enum class Where {
    waiting,  // for something that is not the engine's: it need not give signs of life
    there,
    gone,  // nothing of it lives, or what does will be fenced off by the next attempt
  };
  Where where = Where::there;
  std::string waits_for;         // waiting: for what
  std::optional<Ending> ending;  // gone: how, where the executor knows more than the folder
  std::string batch_job, node;   // of a batch system, where known
};

class Executor {
 public:
  Executor() = default;
  virtual ~Executor() = default;
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // Throws std::runtime_error when it cannot be started. Called without any lock; the others never wait.
  virtual void start(const JobFolder& folder, const AttemptOrder& order) = 0;
  // silence: since the last sign of life of its engine, or since somebody began to listen.
  virtual Sighting look(const JobFolder& folder, std::uint32_t epoch, std::chrono::steady_clock::duration silence) = 0;
  virtual void kill(const JobFolder& folder, std::uint32_t epoch) = 0;
  virtual void withdraw(const JobFolder& folder, std::uint32_t epoch) = 0;  // if it still waits, it shall not begin
  virtual void forget(const JobFolder& folder, std::uint32_t epoch) = 0;    // it has ended, and the server knows
  virtual void tidy() {}                                                    // now and then
};

}  // namespace bedflow::server
