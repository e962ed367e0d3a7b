// In the place of an executor that this server was started without: attempts that an earlier one has left there stay as they are.
#pragma once

#include <stdexcept>

#include "executor.h"

namespace bedflow::server {

class AbsentExecutor final : public Executor {
 public:
  void start(const JobFolder&, const AttemptOrder&) override { throw std::runtime_error("this server has no such executor"); }
  Sighting look(const JobFolder&, std::uint32_t, std::chrono::steady_clock::duration) override {
    return {.where = Sighting::Where::waiting,
            .waits_for = "a server that has its executor",
            .ending = {},
            .batch_job = {},
            .node = {}};
  }
  void kill(const JobFolder&, std::uint32_t) override {}
  void withdraw(const JobFolder&, std::uint32_t) override {}
  void forget(const JobFolder&, std::uint32_t) override {}
};

}  // namespace bedflow::server
