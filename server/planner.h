// The engine's plan of a case: what it would run, or why it cannot. Asked of engines that stay (bedflow-engine --plans), since a
// new process for each submission would cost more than all the rest of it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "bedflow/v1/results.pb.h"

namespace bedflow::server {

class Planner {
 public:
  explicit Planner(std::filesystem::path engine);
  ~Planner();

  // From any thread. A few engines stay; more are started only when these are busy for long. Throws Refusal: invalid_case with
  // the engine's faults, backend_error when it cannot be asked.
  v1::PlanReport plan(const std::string& case_text, std::uint32_t ranks);

 private:
  class Engine;
  struct Answer {
    int code = -1;
    std::string text;
  };
  std::unique_ptr<Engine> take();                  // an idle one, if there is one
  void give_back(std::unique_ptr<Engine> engine);  // none: it was of no use any more
  std::optional<Answer> ask(const std::string& case_text, std::uint32_t ranks);

  const std::filesystem::path program_;
  std::mutex mutex_;
  std::condition_variable given_back_;
  std::vector<std::unique_ptr<Engine>> idle_;
  std::size_t busy_ = 0;  // callers that have one
};

}  // namespace bedflow::server
