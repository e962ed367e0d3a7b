// Where the particles are at time 0. Every rank draws the same numbers and keeps what its block owns, so a bed does not depend
// on the number of ranks.
#pragma once

#include <cstdint>
#include <vector>

#include "parallel/decomposition.h"
#include "particles/store.h"

namespace bedflow {

// Random sequential addition (Widom 1966): each sphere wholly inside the box and apart from those before it. Beyond a solids
// fraction of about 0.3 it takes too long and near 0.38 it jams; a bed denser than that is made by settling.
struct RandomSeeds {
  std::int64_t count = 0;
  std::uint64_t seed = 0;
  Vec3 low, high;                 // of the box that holds the spheres, m
  double velocity_deviation = 0;  // standard deviation of each velocity component (Gaussian), m/s
};
// Owned particles, ids 0 … count − 1 in the order they were drawn. Throws Stop(invalid_case) on all ranks alike when they do
// not fit. Memory and time grow with the number of all particles.
ParticleStore seed_random(const Decomposition& decomposition, double radius, const RandomSeeds& seeds);

// count[0] × count[1] × count[2] particles at rest, spaced evenly in the box (m), half a spacing from its faces; ids x fastest.
ParticleStore seed_lattice(const Decomposition& decomposition, double radius, Int3 count, Vec3 low, Vec3 high);

struct PlacedSphere {
  Vec3 position;  // m
  Vec3 velocity;  // m/s
  Vec3 spin;      // rad/s
};
// ids in the order given. Overlaps are the user's affair: springs may start compressed.
ParticleStore seed_placed(const Decomposition& decomposition, const std::vector<PlacedSphere>& spheres);

}  // namespace bedflow
