#include "particles/seeding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/stop.h"

namespace bedflow {
namespace {

constexpr double radius = 0.6e-3;
const Vec3 box{0.02, 0.03, 0.01};

Decomposition decomposition(const Comm& comm) {
  return Decomposition(comm, {8, 12, 4}, box, {false, false, false});
}
const RandomSeeds seeds{1500, 42, {0, 0.002, 0}, {0.02, 0.028, 0.01}, 0.2};

TEST(Seeding, RandomSpheresLieInTheRegionAndDoNotOverlap) {
  const ParticleStore store = seed_random(decomposition(Comm::self()), radius, seeds);
  ASSERT_EQ(store.owned, 1500u);
  for (std::size_t i = 0; i < store.owned; ++i) {
    for (int d = 0; d < 3; ++d) {
      EXPECT_GE(store.position(i)[d], seeds.low[d] + radius);
      EXPECT_LE(store.position(i)[d], seeds.high[d] - radius);
    }
    for (std::size_t j = 0; j < i; ++j) EXPECT_GE(norm(store.position(i) - store.position(j)), 2 * radius);
  }
}

TEST(Seeding, VelocitiesAreGaussianWithTheDeviationAsked) {
  const ParticleStore store = seed_random(decomposition(Comm::self()), radius, seeds);
  double sum = 0, squares = 0, fourths = 0;
  for (const Vec3 v : store.velocities())
    for (int d = 0; d < 3; ++d) {
      sum += v[d];
      squares += v[d] * v[d];
      fourths += std::pow(v[d], 4);
    }
  const double n = 4500;
  EXPECT_NEAR(sum / n, 0, 4 * 0.2 / std::sqrt(n));  // four standard errors
  EXPECT_NEAR(std::sqrt(squares / n), 0.2, 4 * 0.2 / std::sqrt(2 * n));
  EXPECT_NEAR(fourths / n / std::pow(squares / n, 2), 3, 4 * std::sqrt(24 / n));  // kurtosis of a Gaussian
}

TEST(Seeding, TheBedDoesNotDependOnTheNumberOfRanks) {
  const Comm world = Comm::world();
  const ParticleStore whole = seed_random(decomposition(Comm::self()), radius, seeds);
  const ParticleStore mine = seed_random(decomposition(world), radius, seeds);
  EXPECT_EQ(world.sum(static_cast<std::int64_t>(mine.owned)), 1500);
  for (std::size_t i = 0; i < mine.owned; ++i) {
    EXPECT_EQ(mine.position(i), whole.position(static_cast<std::size_t>(mine.id[i])));
    EXPECT_EQ(mine.velocity(i), whole.velocity(static_cast<std::size_t>(mine.id[i])));
  }
}

TEST(Seeding, TheSeedChoosesTheBedAndNothingElseDoes) {
  RandomSeeds other = seeds;
  other.seed = 43;
  const Decomposition d = decomposition(Comm::self());
  EXPECT_NE(seed_random(d, radius, seeds).positions(), seed_random(d, radius, other).positions());
  RandomSeeds still = seeds;
  still.velocity_deviation = 0;
  EXPECT_EQ(seed_random(d, radius, seeds).positions(), seed_random(d, radius, still).positions());
}

TEST(Seeding, ThreeTenthsSolidFitAndHalfIsRefusedByNameAndFraction) {
  RandomSeeds dense = seeds;
  const double volume = 0.02 * 0.026 * 0.01, sphere = 4.0 / 3 * 3.14159265358979 * radius * radius * radius;
  dense.count = static_cast<std::int64_t>(0.28 * volume / sphere);
  EXPECT_EQ(seed_random(decomposition(Comm::self()), radius, dense).owned, static_cast<std::size_t>(dense.count));
  dense.count = static_cast<std::int64_t>(0.5 * volume / sphere);
  try {
    seed_random(decomposition(Comm::world()), radius, dense);
    FAIL() << "nothing was refused";
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::invalid_case);
    EXPECT_NE(std::string(stop.what()).find("particles.random.region"), std::string::npos) << stop.what();
    EXPECT_NE(std::string(stop.what()).find("0.49"), std::string::npos) << stop.what();
  }
}

TEST(Seeding, ALatticeFillsItsRegionHalfASpacingFromTheFaces) {
  const ParticleStore store = seed_lattice(decomposition(Comm::self()), radius, {4, 3, 2}, {0, 0, 0}, {0.02, 0.03, 0.01});
  ASSERT_EQ(store.owned, 24u);
  EXPECT_NEAR(store.position(0).x, 0.0025, 1e-17);
  EXPECT_NEAR(store.position(23).z, 0.0075, 1e-17);
  EXPECT_NEAR(store.position(1).x - store.position(0).x, 0.005, 1e-17);
  EXPECT_EQ(store.id[23], 23);
  EXPECT_THROW(seed_lattice(decomposition(Comm::self()), radius, {17, 3, 2}, {0, 0, 0}, {0.02, 0.03, 0.01}), Stop);
}

TEST(Seeding, PlacedSpheresGoToTheirOwnersAsGiven) {
  const Comm world = Comm::world();
  std::vector<PlacedSphere> spheres;
  spheres.reserve(9);
  for (int i = 0; i < 9; ++i)
    spheres.push_back({{0.002 + 0.002 * i, 0.003 + 0.003 * i, 0.005}, {0.1 * i, 0, 0}, {0, 0, 1.0 * i}});
  const Decomposition d = decomposition(world);
  const ParticleStore store = seed_placed(d, spheres);
  EXPECT_EQ(world.sum(static_cast<std::int64_t>(store.owned)), 9);
  for (std::size_t i = 0; i < store.owned; ++i) {
    const PlacedSphere& given = spheres[static_cast<std::size_t>(store.id[i])];
    EXPECT_EQ(store.position(i), given.position);
    EXPECT_EQ(store.velocity(i), given.velocity);
    EXPECT_EQ(store.spin(i), given.spin);
    EXPECT_EQ(d.owner(given.position), world.rank());
  }
}

}  // namespace
}  // namespace bedflow
