// Parcels against what is known of the particles that they stand for.
#include <gtest/gtest.h>

#include <numbers>
#include <utility>

#include "support/scene.h"

namespace bedflow {
namespace {

// Overlap over diameter is kept, so an impact of parcels twice as wide at the same speed lasts twice as long.
TEST(Parcels, TouchAsMuchLongerAsTheyAreWider) {
  const std::string linear = "linear_spring_dashpot { stiffness: 500 restitution: 0.9 wall_stiffness: 700 }";
  const std::string hertz = "hertz { youngs_modulus: 1e7 poisson_ratio: 0.3 restitution: 0.9 impact_speed: 1 }";
  for (const std::string& law : {linear, hertz}) {
    const auto time = [&](const std::string& parcels) {
      return scene_of(Comm::world(), R"(name: "impact" domain { size { x: 0.1 y: 0.1 z: 0.1 } } gravity {}
        particles { diameter: 0.001 density: 1000 frictionless {} symplectic_euler {} random { count: 800 seed: 1 } )" +
                                         law + parcels + " } time { end: 1 }")
          .particles->collision_time;
    };
    EXPECT_NEAR(time("coarse_graining { factor: 2 contacts: KEEP_RESTITUTION }") / time(""), 2, 1e-13) << law;
  }
}

// A gas of 12 000 spheres that cools by its collisions, as 1 500 parcels. Haff (1983): T/T0 = (1 + (1 − e²) ω0 t/6)^−2, ω0 = 4 n
// d² g0 √(πT0) of the particles, g0 = (1 − φ/2)/(1 − φ)³. Parcels that keep e collide half as often and cool half as fast.
TEST(Parcels, CoolAsTheirParticles) {
  const Comm world = Comm::world();
  const double fraction = 0.1, e = 0.9, diameter = 0.5e-3;
  for (const auto& [contacts, slower] : {std::pair{"KEEP_DISSIPATION", 1.0}, {"KEEP_RESTITUTION", 2.0}}) {
    const std::string text =
        R"(name: "cooling" domain { size { x: 0.02 y: 0.02 z: 0.02 } periodic { x: true y: true z: true } } gravity {}
      particles { diameter: 0.5e-3 density: 2500 linear_spring_dashpot { stiffness: 500 restitution: 0.9 } frictionless {}
        symplectic_euler {} steps_per_collision: 15 coarse_graining { factor: 2 contacts: )" +
        std::string(contacts) + R"( }
        random { solids_fraction: 0.1 seed: 21 velocity_deviation: 0.1 } } time { end: 10 })";
    PhaseTimer timer;
    Simulation box(make_plan(scene_of(world, text), world.size()), world, timer);
    box.seed();
    const ParticleStore& store = box.particles()->particles();
    const auto temperature = [&] {
      double sum = 0;
      for (std::size_t p = 0; p < store.owned; ++p) sum += dot(store.velocity(p), store.velocity(p));
      return world.sum(sum) / 3 / world.sum(static_cast<double>(store.owned));
    };
    while (box.time() < 0.005) box.step();  // about one collision each: the random places forget themselves
    const double start = temperature(), from = box.time(), g0 = (1 - fraction / 2) / std::pow(1 - fraction, 3);
    const double rate = 24 * fraction / (std::numbers::pi * diameter) * g0 * std::sqrt(std::numbers::pi * start);
    for (const double collisions : {5.0, 10.0, 20.0}) {
      while (box.time() < from + collisions / rate) box.step();
      const double haff = std::pow(1 + (1 - e * e) * rate * (box.time() - from) / 6 / slower, -2);
      // 1500 parcels: T is known to √(2/(3 · 1500)) = 2 %, at both ends; a contact lasts 1 % of the time between two.
      EXPECT_NEAR(temperature() / start / haff, 1, 0.06) << contacts << " after " << collisions << " collisions of each particle";
    }
    ASSERT_FALSE(box.failure()) << box.failure().message;
  }
}

// Monitors count particles.
TEST(Parcels, AreCountedByTheirParticles) {
  const Comm world = Comm::world();
  const Plan plan = make_plan(scene_of(world, R"(name: "box" domain { size { x: 0.1 y: 0.1 z: 0.1 } } gravity {}
      particles { diameter: 0.001 density: 1000 linear_spring_dashpot { stiffness: 500 restitution: 0.9 } frictionless {}
        symplectic_euler {} random { count: 800 seed: 1 } coarse_graining { factor: 2 } } time { end: 1 }
      monitors { name: "count" particle_count {} interval: 0 })"),
                              world.size());
  PhaseTimer timer;
  Simulation box(plan, world, timer);
  box.seed();
  EXPECT_EQ(world.sum(static_cast<std::int64_t>(box.particles()->particles().owned)), 100);
  EXPECT_EQ(std::get<ParticleCount>(plan.scene.monitors[0].statistic).parcel, 8);
}

}  // namespace
}  // namespace bedflow
