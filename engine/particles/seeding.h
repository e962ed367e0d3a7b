// Where the particles are at time 0. Every rank draws the same numbers and keeps what its block owns, so a bed does not depend
// on the number of ranks.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "base/sphere.h"
#include "parallel/decomposition.h"
#include "particles/sizes.h"
#include "particles/store.h"

namespace bedflow {

// A type of particle, as far as seeding asks.
struct SeedKind {
  std::string name;
  SizeDistribution sizes;
  double density = 0;  // kg/m³

  double mean_volume() const { return sphere_volume(1) * sizes.moment(3); }  // m³, of the law
};

// Shares by number, adding up to 1, from shares of either basis; the mean masses are those of the laws.
std::vector<double> number_shares(const std::vector<SeedKind>& kinds, std::vector<double> shares, Basis basis);

// Random sequential addition (Widom 1966), the largest first: each sphere wholly inside the box and apart from all others. Beyond
// a solids fraction of about 0.3 it takes too long and near 0.38 (one size) it jams; a bed denser than that is made by settling.
struct RandomSeeds {
  std::int64_t count = 0;
  std::uint64_t seed = 0;
  Vec3 low, high;                   // of the box that holds the spheres, m
  double velocity_deviation = 0;    // standard deviation of each velocity component (Gaussian), m/s
  double solids_fraction = 0;       // above 0: in place of the count; reached to within half a sphere of each kind
  std::vector<double> shares = {};  // of the kinds, by number; empty: there is one kind
};
// count[0] × count[1] × count[2] particles at rest, spaced evenly in the box (m), half a spacing from its faces; x fastest.
struct LatticeSeeds {
  Int3 count{};
  Vec3 low, high;
  std::uint64_t seed = 0;           // of kinds and sizes
  std::vector<double> shares = {};  // as above
};
// In the order given. Overlaps within the list are the user's affair: springs may start compressed.
struct PlacedSphere {
  Vec3 position{};      // m
  Vec3 velocity{};      // m/s
  Vec3 spin{};          // rad/s
  int kind = 0;         // index
  double diameter = 0;  // m; 0: drawn from the kind's law
};
using PlacedSeeds = std::vector<PlacedSphere>;

struct SeedRegion {
  std::string path;  // of the case, for messages
  std::variant<RandomSeeds, LatticeSeeds, PlacedSeeds> seeds;
};

// How many particles the region will hold; for a solids fraction of distributed sizes what is to be expected.
std::int64_t expected_count(const std::vector<SeedKind>& kinds, const SeedRegion& region);

// The box around all regions, m.
struct SeedExtent {
  Vec3 low, high;
};
SeedExtent seed_extent(const std::vector<SeedRegion>& regions);

// All of the scene's particles with kind and diameter, first those of placed and lattice regions, then the random ones, which
// keep clear of them. Throws Stop(invalid_case) when they do not fit. Memory and time grow with the number of all particles.
std::vector<PlacedSphere> seed_spheres(const std::vector<SeedKind>& kinds, const std::vector<SeedRegion>& regions);

// Those that this rank's block owns; the id is the place in the list.
ParticleStore keep_owned(const Decomposition& decomposition, const DemSetup& setup, const std::vector<PlacedSphere>& spheres);

}  // namespace bedflow
