// A line of the log that strangers can bring about: at most one a second, however often they knock.
#pragma once

#include <chrono>
#include <mutex>
#include <optional>
#include <string>

namespace bedflow::server {

class Rarely {
 public:
  // Nothing: not now. Else what to put behind the line: how many there were that nobody was told of, or nothing.
  std::optional<std::string> now() {
    const auto time = std::chrono::steady_clock::now();
    const std::lock_guard guard(mutex_);
    if (last_ && time - *last_ < std::chrono::seconds(1)) {
      ++untold_;
      return std::nullopt;
    }
    const std::string behind = untold_ > 0 ? " (and " + std::to_string(untold_) + " more like it)" : "";
    last_ = time;
    untold_ = 0;
    return behind;
  }

 private:
  std::mutex mutex_;
  std::optional<std::chrono::steady_clock::time_point> last_;
  std::size_t untold_ = 0;
};

}  // namespace bedflow::server
