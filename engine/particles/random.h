// Random numbers that are the same from the same seed with any library: std::mt19937_64 is specified to the bit, the standard
// distributions are not.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "base/vec3.h"

namespace bedflow {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }  // [0, 1)
  Vec3 inside(Vec3 low, Vec3 high) {
    Vec3 x;
    for (int d = 0; d < 3; ++d) x[d] = low[d] + uniform() * (high[d] - low[d]);
    return x;
  }
  double gaussian() {  // Box & Muller
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace bedflow
