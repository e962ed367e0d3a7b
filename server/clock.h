// The time of day, as it is kept and told.
#pragma once

#include <chrono>
#include <cstdint>

namespace bedflow::server {

// Since the epoch of Unix.
inline std::int64_t now_nanos() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace bedflow::server
