// Tests by chance: how often, and from which seed. A seed is printed, and BEDFLOW_SEED repeats it; BEDFLOW_LONG asks for the
// large count, as ctest does for what has the label "long".
#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>

namespace bedflow::test {

inline int trials(int few, int many) {
  return std::getenv("BEDFLOW_LONG") ? many : few;
}

inline std::uint64_t chosen_seed() {
  const char* const given = std::getenv("BEDFLOW_SEED");
  const std::uint64_t seed = given ? std::stoull(given) : std::random_device()();
  std::cout << "seed " << seed << " (BEDFLOW_SEED=" << seed << " repeats it)" << std::endl;
  return seed;
}

class Chance {
 public:
  explicit Chance(std::uint64_t seed = chosen_seed()) : engine_(seed) {}
  std::uint64_t below(std::uint64_t end) { return std::uniform_int_distribution<std::uint64_t>(0, end - 1)(engine_); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace bedflow::test
