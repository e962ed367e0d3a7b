// What a picture of the bed needs, taken from a checkpoint.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/vec3.h"
#include "parallel/decomposition.h"

namespace bedflow {

struct Picture {
  std::uint64_t step = 0;
  double time = 0;                   // s
  Vec3 size;                         // of the box, m
  double diameter = 0;               // of the largest particles, m; 0 without particles
  std::vector<Vec3> positions;       // m
  std::vector<double> speeds;        // m/s, one a position
  std::vector<double> diameters;     // m, one a position; empty where all are alike
  Int3 cells{};                      // of the box; 0 without gas
  std::vector<double> gas_fraction;  // ε, mean over the depth (z), x fastest, then y; empty without gas
};

// Every n-th particle, the same n for all, so that at most `most_particles` are left. For one rank alone.
// Throws Stop(checkpoint_corrupt) naming dataset and block.
Picture read_picture(const std::filesystem::path& checkpoint, std::uint32_t most_particles);

}  // namespace bedflow
