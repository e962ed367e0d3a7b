// Beds and balls that come to rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/dem_scene.h"

namespace bedflow {
namespace {

constexpr double gravity = 9.81;

template <class Law>
class Pile : public testing::Test {};
using Laws = testing::Types<Frictionless, Coulomb, TangentialSpring>;
TYPED_TEST_SUITE(Pile, Laws);

// Falls and rests; what all walls carry is the weight, to round-off when the change of momentum is counted.
TYPED_TEST(Pile, ComesToRestWithItsWeightOnTheWalls) {
  const Comm self = Comm::self();
  const Spheres spheres{.restitution = 0.5, .friction = 0.4, .gravity = {0, -gravity, 0}};
  const double d = spheres.diameter, dt = spheres.collision_time() / 20;
  Scene<TypeParam> pile(self, {10 * d, 30 * d, 10 * d}, spheres);
  pile.seed({.count = 600, .seed = 5, .low = {}, .high = {10 * d, 30 * d, 10 * d}});
  const double weight = 600 * spheres.mass() * gravity;
  const auto momentum = [&] {
    double sum = 0;
    for (std::size_t i = 0; i < pile.dem.particles().owned; ++i) sum += spheres.mass() * pile.dem.particles().velocity(i).y;
    return sum;
  };
  pile.advance(static_cast<int>(0.4 / dt), dt);
  pile.dem.take_wall_loads();
  const double before = momentum();
  constexpr int substeps = 2000;
  pile.advance(substeps, dt);
  ASSERT_FALSE(pile.dem.failure()) << pile.dem.failure().message;

  double carried = 0;
  for (const WallLoad& load : pile.dem.take_wall_loads()) carried -= load.force.y;
  const double time = substeps * dt;
  EXPECT_NEAR((carried - (momentum() - before) / time) / weight, 1, 1e-11);  // 2000 sums of 1e2 forces at the floor
  EXPECT_NEAR(carried / weight, 1, 1e-3);                                    // and the bed has stopped
  // Of the energy of a fall by one diameter: what is left is of the few that roll or creep, which no law here hinders.
  const double floor = pile.dem.kinetic_energy() / (weight * d);
  std::printf("  %-12s kinetic energy over weight and diameter %.2g\n", TypeParam::name, floor);
  EXPECT_LT(floor, 1e-4);
}

// The n-th apex is R + (h − R) e^2n; a contact that takes time τ ~ 1/sqrt(k) is late by as much.
TEST(BouncingBall, TendsToTheHardSphereAsItGetsStiffer) {
  constexpr double drop = 0.5, e = 0.8;
  std::vector<double> errors;
  for (const double stiffness : {5e4, 5e5, 5e6}) {
    const Spheres spheres{
        .diameter = 0.2, .density = 2600, .stiffness = stiffness, .restitution = e, .gravity = {0, -gravity, 0}, .skin = 0.02};
    Scene<Frictionless> scene(Comm::self(), {1, 1, 1}, spheres);
    scene.place({{{0.5, drop, 0.5}, {}, {}, 0, spheres.diameter}});
    const double dt = spheres.contact().collision_time(spheres.mass()) / 100, radius = spheres.diameter / 2;
    double worst = 0, rises = 0;
    for (int bounce = 0; bounce < 5;) {
      scene.advance(1, dt);
      const double before = std::exchange(rises, scene.dem.particles().velocity(0).y);
      if (before <= 0 || rises > 0) continue;  // not at the top
      const double expected = radius + (drop - radius) * std::pow(e * e, ++bounce);
      worst = std::max(worst, std::abs(scene.dem.particles().position(0).y - expected) / (drop - radius));
    }
    errors.push_back(worst);
    std::printf("  k = %-8.0e heights within %.2e of the fall\n", stiffness, worst);
  }
  EXPECT_LT(errors[1], 0.5 * errors[0]);
  EXPECT_LT(errors[2], 0.5 * errors[1]);
  EXPECT_LT(errors[2], 2e-3);
}

}  // namespace
}  // namespace bedflow
