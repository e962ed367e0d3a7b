// Many particles: what is conserved, and that no contact is missed. On any number of ranks.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/dem_scene.h"
#include "support/touching_pairs.h"

namespace bedflow {
namespace {

template <class Law>
class Crowd : public testing::Test {};
using Laws = testing::Types<Frictionless, Coulomb, TangentialSpring>;
TYPED_TEST_SUITE(Crowd, Laws);

struct Totals {
  Vec3 momentum, angular;
  double moving = 0, turning = 0;  // sums of the sizes, to compare round-off with
};
Totals totals(const std::map<std::int64_t, Particle>& particles, const Spheres& spheres) {
  Totals result;
  const double mass = spheres.mass(), inertia = 0.1 * mass * spheres.diameter * spheres.diameter;
  for (const auto& [id, p] : particles) {
    const Vec3 turn = cross(p.position, mass * p.velocity) + inertia * p.spin;
    result.momentum += mass * p.velocity;
    result.angular += turn;
    result.moving += norm(mass * p.velocity);
    result.turning += norm(turn);
  }
  return result;
}

// A cloud of 1000 spheres in the middle of a periodic box, so that angular momentum does not cross its faces.
TYPED_TEST(Crowd, MomentumAndAngularMomentumAreConserved) {
  Spheres spheres;
  spheres.friction = 0.4;
  spheres.sides = {Side::periodic, Side::periodic, Side::periodic};
  Scene<TypeParam> scene(Comm::world(), {0.04, 0.04, 0.04}, spheres);
  scene.seed({1000, 7, {0.012, 0.012, 0.012}, {0.028, 0.028, 0.028}, 0.3});
  const auto before = scene.gathered();
  scene.advance(600, spheres.collision_time() / 20);
  const auto after = scene.gathered();
  const Totals a = totals(before, spheres), b = totals(after, spheres);
  EXPECT_EQ(after.size(), 1000u);
  EXPECT_LT(norm(b.momentum - a.momentum), 1e-13 * a.moving);  // 600 sub-steps of round-off
  EXPECT_LT(norm(b.angular - a.angular), 1e-13 * a.turning);
}

// Across periodic faces, on ranks that are their own neighbours too.
TYPED_TEST(Crowd, MomentumIsConservedAcrossPeriodicFaces) {
  Spheres spheres;
  spheres.sides = {Side::periodic, Side::periodic, Side::periodic};
  Scene<TypeParam> scene(Comm::world(), {0.015, 0.015, 0.015}, spheres);
  scene.seed({1000, 8, {0, 0, 0}, {0.015, 0.015, 0.015}, 0.5});
  const Totals a = totals(scene.gathered(), spheres);
  scene.advance(600, spheres.collision_time() / 20);
  const auto after = scene.gathered();
  EXPECT_EQ(after.size(), 1000u);
  EXPECT_LT(norm(totals(after, spheres).momentum - a.momentum), 1e-13 * a.moving);
  for (const auto& [id, p] : after)
    for (int d = 0; d < 3; ++d) EXPECT_TRUE(p.position[d] > -spheres.skin && p.position[d] < 0.015 + spheres.skin) << id;
}

// Kinetic and elastic normal energy; the elastic tangential part is a few percent of what a sample interval dissipates.
TYPED_TEST(Crowd, EnergyOnlyFalls) {
  Spheres spheres;
  spheres.restitution = 0.8;
  spheres.friction = 0.3;
  spheres.sides = {Side::periodic, Side::periodic, Side::periodic};
  const double edge = 0.015;
  Scene<TypeParam> scene(Comm::world(), {edge, edge, edge}, spheres);
  scene.seed({1000, 9, {0, 0, 0}, {edge, edge, edge}, 0.5});
  const auto energy = [&] {
    double result = scene.decomposition().comm().sum(scene.dem.kinetic_energy());
    const auto particles = scene.gathered();
    for (auto i = particles.begin(); i != particles.end(); ++i)
      for (auto j = std::next(i); j != particles.end(); ++j) {
        Vec3 apart = j->second.position - i->second.position;
        for (int d = 0; d < 3; ++d) apart[d] -= edge * std::round(apart[d] / edge);
        const double overlap = spheres.diameter - norm(apart);
        if (overlap > 0) result += 0.5 * spheres.stiffness * overlap * overlap;
      }
    return result;
  };
  double last = energy();
  const double first = last;
  for (int sample = 0; sample < 10; ++sample) {
    scene.advance(200, spheres.collision_time() / 20);
    const double now = energy();
    EXPECT_LT(now, last) << sample;
    last = now;
  }
  EXPECT_LT(last, 0.7 * first);
}

// A fast gas, its list rebuilt every few sub-steps: the pairs that touch are those that brute force finds.
TEST(PairList, NoContactIsEverMissed) {
  for (const bool periodic : {false, true}) {
    Spheres spheres;
    spheres.skin = 0.06e-3;
    if (periodic) spheres.sides = {Side::periodic, Side::periodic, Side::periodic};
    const double edge = 0.011;
    Scene<Coulomb> scene(Comm::world(), {edge, edge, edge}, spheres);
    scene.seed({350, 11, {0, 0, 0}, {edge, edge, edge}, 0.6});
    const double dt = spheres.collision_time() / 20;
    std::int64_t met = 0;
    for (int n = 0; n < 300; ++n) {
      const auto particles = scene.gathered();
      const auto both = [&](const Particle&, const Particle&) { return spheres.diameter; };
      const std::int64_t expected = touching_pairs(particles, both, periodic ? edge : 0);
      scene.advance(1, dt);
      ASSERT_EQ(scene.decomposition().comm().sum(scene.dem.contact_count()), expected) << "sub-step " << n;
      met += expected;
    }
    EXPECT_GT(met, 1000);
    EXPECT_GT(scene.dem.rebuilds(), 40);
    EXPECT_LT(scene.dem.rebuilds(), 250);  // by displacement, not every sub-step
  }
}

TEST(PairList, ParticlesAtRestNeverRebuildIt) {
  Spheres spheres;
  Scene<Coulomb> scene(Comm::world(), {0.02, 0.02, 0.02}, spheres);
  scene.seed({100, 3, {0, 0, 0}, {0.02, 0.02, 0.02}, 0});
  scene.advance(1000, spheres.collision_time() / 20);
  EXPECT_EQ(scene.dem.rebuilds(), 0);
}

TEST(Dem, AFewParticlesInAHugeBoxNeedNoMoreCellsThanParticles) {
  Spheres spheres;
  spheres.diameter = 1e-6;
  spheres.skin = 1e-7;
  Scene<Coulomb> scene(Comm::world(), {1, 1, 1}, spheres);
  scene.place({{{0.001, 0.001, 0.001}, {}, {}}, {{0.999, 0.999, 0.999}, {}, {}}, {{0.999, 0.999, 0.999 + 0.9e-6}, {}, {}}});
  scene.advance(1, 1e-12);
  EXPECT_EQ(scene.decomposition().comm().sum(scene.dem.contact_count()), 1);
}

// ---------------------------------------------------------------------------------------------------- failures

TEST(Failure, ALostParticleIsNamedAndAllRanksStopTogether) {
  Spheres spheres;
  Scene<Coulomb> scene(Comm::world(), {0.02, 0.02, 0.02}, spheres);
  std::vector<PlacedSphere> placed(20);
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 5; ++column)
      placed[5 * row + column].position = {0.002 + 0.004 * column, 0.002 + 0.004 * row, 0.01};
  placed[2].velocity = {0, -60, 0};  // the centre reaches the wall from r √(k/m) = 13 m/s on
  scene.place(placed);
  scene.advance(1000, 1e-7);
  const Comm& comm = scene.decomposition().comm();
  EXPECT_EQ(comm.sum(static_cast<std::int64_t>(static_cast<bool>(scene.dem.failure()))), 1);
  if (scene.dem.failure()) {
    EXPECT_EQ(scene.dem.failure().reason, Reason::particle_lost);
    EXPECT_NE(scene.dem.failure().message.find("particle 2 passed the wall y_low"), std::string::npos)
        << scene.dem.failure().message;
  }
  const auto before = scene.gathered();
  scene.advance(10, 1e-7);
  EXPECT_EQ(scene.gathered().at(0).position, before.at(0).position);
}

TEST(Failure, AParticleThatReachesAnOpenFaceIsLost) {
  Spheres spheres;
  spheres.sides[2] = Side::open;
  Scene<Frictionless> scene(Comm::world(), {0.02, 0.02, 0.02}, spheres);
  scene.place({{{0.01, 0.01, 0.019}, {0, 0, 1}, {}}, {{0.01, 0.01, 0.01}, {}, {}}});
  scene.advance(900, 1e-6);
  EXPECT_FALSE(scene.decomposition().comm().any(static_cast<bool>(scene.dem.failure())));  // touches, does not yet leave
  scene.advance(200, 1e-6);
  EXPECT_TRUE(scene.decomposition().comm().any(static_cast<bool>(scene.dem.failure())));
  if (scene.dem.failure()) {
    EXPECT_NE(scene.dem.failure().message.find("particle 0 left through the open face z_high"), std::string::npos)
        << scene.dem.failure().message;
  }
}

TEST(Failure, WhatIsNotFiniteOrJumpsOverOthersHasDiverged) {
  for (const double speed : {std::nan(""), 1e300, 5000.0}) {
    Spheres spheres;
    Scene<Frictionless> scene(Comm::world(), {0.02, 0.02, 0.02}, spheres);
    scene.place({{{0.004, 0.01, 0.01}, {0, 0, 0}, {}}, {{0.01, 0.01, 0.01}, {}, {}}});
    ParticleStore& p = scene.dem.particles();
    for (std::size_t i = 0; i < p.owned; ++i)
      if (p.id[i] == 0) p.velocity(i) = {speed, 0, 0};
    scene.advance(100, 1e-6);
    EXPECT_EQ(scene.decomposition().comm().sum(static_cast<std::int64_t>(static_cast<bool>(scene.dem.failure()))), 1) << speed;
    if (scene.dem.failure()) {
      EXPECT_EQ(scene.dem.failure().reason, speed < 1e300 ? Reason::diverged : scene.dem.failure().reason);
      EXPECT_NE(scene.dem.failure().message.find("particle 0 "), std::string::npos);
    }
  }
}

TEST(Dem, ABoxTooNarrowForItsParticlesIsRefusedByName) {
  Spheres spheres;
  spheres.sides[0] = Side::periodic;
  try {
    Scene<Frictionless> scene(Comm::self(), {0.0029, 0.02, 0.02}, spheres);
    FAIL() << "nothing was refused";
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::invalid_case);
    EXPECT_NE(std::string(stop.what()).find("domain.size.x"), std::string::npos) << stop.what();
  }
}

}  // namespace
}  // namespace bedflow
