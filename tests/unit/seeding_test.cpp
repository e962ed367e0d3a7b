#include "support/seeds.h"

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

// ---------------------------------------------------------------------------------------------------- kinds and sizes

double sphere(double d) {
  return 3.14159265358979 / 6 * d * d * d;
}
const std::vector<SeedKind> mixture{
    {"sand", SizeDistribution(LogNormalSizes{0.8e-3, 0.3, 0.4e-3, 2e-3}), 2600},
    {"pellets", SizeDistribution(ConstantSize{2e-3}), 900},
};
void expect_apart(const std::vector<PlacedSphere>& spheres) {
  for (std::size_t i = 0; i < spheres.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GE(norm(spheres[i].position - spheres[j].position), (spheres[i].diameter + spheres[j].diameter) / 2 * (1 - 1e-15));
    }
}
std::int64_t count_of(const std::vector<PlacedSphere>& spheres, int kind) {
  return std::ranges::count(spheres, kind, &PlacedSphere::kind);
}

TEST(Seeding, SpheresOfDifferentSizesLieInTheRegionAndDoNotOverlap) {
  RandomSeeds random = seeds;
  random.shares = {0.8, 0.2};
  const std::vector<PlacedSphere> spheres = seed_spheres(mixture, {{"particles", random}});
  ASSERT_EQ(spheres.size(), 1500u);
  expect_apart(spheres);
  for (const PlacedSphere& s : spheres)
    for (int d = 0; d < 3; ++d) {
      EXPECT_GE(s.position[d], seeds.low[d] + s.diameter / 2);
      EXPECT_LE(s.position[d], seeds.high[d] - s.diameter / 2);
    }
  EXPECT_EQ(count_of(spheres, 1), 300);  // shares are met to one particle
}

TEST(Seeding, SharesByMassAreMetByTheMassOfTheBed) {
  RandomSeeds random = seeds;
  random.shares = number_shares(mixture, {3, 1}, Basis::mass);
  double mass[2]{}, largest = 0;
  for (const PlacedSphere& s : seed_spheres(mixture, {{"particles", random}})) {
    mass[s.kind] += mixture[s.kind].density * sphere(s.diameter);
    largest = std::max(largest, mixture[s.kind].density * sphere(s.diameter));
  }
  // Four standard errors of the mass of n log-normal spheres: the squared cube has the relative variance m6/m3² − 1.
  const SizeDistribution& sand = mixture[0].sizes;
  const double n = 1500 * random.shares[0];
  const double error = 4 * std::sqrt((sand.moment(6) / std::pow(sand.moment(3), 2) - 1) / n);
  EXPECT_NEAR(mass[0] / mass[1], 3, 3 * error + 3 * largest / mass[1]);
}

TEST(Seeding, ASolidsFractionIsReachedToWithinHalfASphereOfEachKind) {
  RandomSeeds random = seeds;
  random.count = 0;
  random.solids_fraction = 0.2;
  random.shares = {0.9, 0.1};
  const std::vector<PlacedSphere> spheres = seed_spheres(mixture, {{"particles", random}});
  double solids = 0;
  for (const PlacedSphere& s : spheres) solids += sphere(s.diameter);
  const double box_volume = 0.02 * 0.026 * 0.01;
  EXPECT_NEAR(solids / box_volume, 0.2, 2 * sphere(2e-3) / 2 / box_volume);
  EXPECT_NEAR(static_cast<double>(expected_count(mixture, {"particles", random})), static_cast<double>(spheres.size()),
              0.2 * static_cast<double>(spheres.size()));
}

// Two sizes 1:5, the small ones between the large ones: every overlap is found whatever the ratio.
TEST(Seeding, SizesOneToFiveDoNotOverlap) {
  const std::vector<SeedKind> kinds{{"large", SizeDistribution(ConstantSize{3e-3}), 1},
                                    {"small", SizeDistribution(ConstantSize{0.6e-3}), 1}};
  RandomSeeds random{0, 7, {0, 0, 0}, {0.02, 0.02, 0.01}};
  random.solids_fraction = 0.34;
  random.shares = number_shares(kinds, {1, 1}, Basis::mass);
  const std::vector<PlacedSphere> spheres = seed_spheres(kinds, {{"particles", random}});
  EXPECT_EQ(count_of(spheres, 0), std::lround(0.17 * 4e-6 / sphere(3e-3)));
  EXPECT_EQ(count_of(spheres, 1), std::lround(0.17 * 4e-6 / sphere(0.6e-3)));
  expect_apart(spheres);
}

TEST(Seeding, RandomRegionsKeepClearOfLatticesPlacedSpheresAndEachOther) {
  RandomSeeds random = seeds;
  random.count = 500;
  random.shares = {1, 0};
  RandomSeeds another = random;
  another.seed = 5;
  LatticeSeeds lattice{{4, 4, 2}, {0, 0.01, 0}, {0.02, 0.02, 0.01}};
  lattice.shares = {0.5, 0.5};
  const std::vector<SeedRegion> regions{
      {"a", random}, {"b", lattice}, {"c", PlacedSeeds{{.position = {0.01, 0.005, 0.005}, .kind = 1}}}, {"d", another}};
  const std::vector<PlacedSphere> spheres = seed_spheres(mixture, regions);
  ASSERT_EQ(spheres.size(), 500u + 32 + 1 + 500);
  expect_apart(spheres);
  EXPECT_EQ(count_of(spheres, 1), 16 + 1);
  EXPECT_EQ(spheres[32].diameter, 2e-3);  // a placed one without a diameter has that of its kind
}

TEST(Seeding, ALatticeMixesItsKinds) {
  LatticeSeeds lattice{{10, 10, 1}, {0, 0, 0}, {0.03, 0.03, 0.003}};
  lattice.shares = {0.5, 0.5};
  const std::vector<PlacedSphere> spheres = seed_spheres(mixture, {{"particles", lattice}});
  int changes = 0;
  for (std::size_t i = 1; i < spheres.size(); ++i) changes += spheres[i].kind != spheres[i - 1].kind;
  EXPECT_EQ(count_of(spheres, 0), 50);
  EXPECT_NEAR(changes, 50, 4 * 5);  // four standard deviations of runs in a fair shuffle
}

TEST(Seeding, RegionsThatOverlapAreRefusedByName) {
  const SeedRegion lattice{"particles.composed.regions[0]", LatticeSeeds{{2, 2, 2}, {0, 0, 0}, {0.01, 0.01, 0.01}, 0, {0, 1}}};
  const auto placed = [](double x) {
    return SeedRegion{"particles.composed.regions[1]", PlacedSeeds{{.position = {x, 0.0025, 0.0025}, .kind = 1}}};
  };
  EXPECT_NO_THROW(seed_spheres(mixture, {lattice, placed(0.0044)}));  // 0.95 of a diameter away: a preloaded contact
  try {
    seed_spheres(mixture, {lattice, placed(0.0042)});
    FAIL() << "nothing was refused";
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::invalid_case);
    EXPECT_NE(std::string(stop.what()).find("particles.composed.regions[1]: its particle at (0.0042"), std::string::npos)
        << stop.what();
  }
}

}  // namespace
}  // namespace bedflow
