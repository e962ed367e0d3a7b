// The engine's plan of a case: what it would run, or why it cannot. Asked of engines that stay (bedflow-engine --plans), since a
// new process for each submission would cost more than all the rest of it.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "bedflow/v1/results.pb.h"

namespace bedflow::server {

class Planner {
 public:
  explicit Planner(std::filesystem::path engine);
  ~Planner();

  // From any thread; as many engines as callers at once, of which a few stay. Throws Refusal: invalid_case with the engine's
  // faults, backend_error when it cannot be asked.
  v1::PlanReport plan(const std::string& case_text, std::uint32_t ranks);

 private:
  class Engine;
  std::unique_ptr<Engine> take();
  void give_back(std::unique_ptr<Engine> engine);

  const std::filesystem::path program_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Engine>> idle_;
};

}  // namespace bedflow::server
