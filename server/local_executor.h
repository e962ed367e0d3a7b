// Starts and ends attempts on this machine. An attempt is a runner in its own session, with the engine's processes below it.
//
// The lock of an attempt is taken before the runner exists and handed down to it and to what it starts: a job never has two live
// attempts, whatever is killed when.
#pragma once

#include <sys/types.h>

#include <utility>
#include <vector>

#include "executor.h"

namespace bedflow::server {

class LocalExecutor final : public Executor {
 public:
  explicit LocalExecutor(Programs programs) : programs_(std::move(programs)) {}

  // Throws also when an earlier attempt still lives.
  void start(const JobFolder& folder, const AttemptOrder& order) override;
  Sighting look(const JobFolder& folder, std::uint32_t epoch, std::chrono::steady_clock::duration silence) override;
  void kill(const JobFolder& folder, std::uint32_t epoch) override;  // SIGKILL to all of the attempt's session
  void withdraw(const JobFolder&, std::uint32_t) override {}         // nothing waits here
  void forget(const JobFolder&, std::uint32_t) override {}
  void tidy() override;  // children of ours that have ended

 private:
  Programs programs_;
  std::vector<pid_t> runners_;  // started by this server
};

}  // namespace bedflow::server
