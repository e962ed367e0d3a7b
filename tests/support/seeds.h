// Spheres of one type and one size in one region, those that this rank's block owns.
#pragma once

#include <vector>

#include "particles/seeding.h"

namespace bedflow {

inline ParticleStore seed_one(const Decomposition& decomposition, double radius, const SeedRegion& region) {
  DemSetup setup;
  setup.types = {{radius, 1, false}};
  return keep_owned(decomposition, setup, seed_spheres({{"particles", SizeDistribution(ConstantSize{2 * radius}), 1}}, {region}));
}

inline ParticleStore seed_random(const Decomposition& decomposition, double radius, const RandomSeeds& seeds) {
  return seed_one(decomposition, radius, {"particles", seeds});
}

inline ParticleStore seed_lattice(const Decomposition& decomposition, double radius, Int3 count, Vec3 low, Vec3 high) {
  return seed_one(decomposition, radius, {"particles", LatticeSeeds{count, low, high}});
}

inline ParticleStore seed_placed(const Decomposition& decomposition, const std::vector<PlacedSphere>& spheres) {
  return seed_one(decomposition, 1, {"particles", spheres});
}

}  // namespace bedflow
