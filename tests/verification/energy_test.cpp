// The energy of contacts: what they give and hold is accounted for as the particles move, and what a motion that is integrated
// too coarsely creates is found before anything else goes wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/dem_scene.h"

namespace bedflow {
namespace {

constexpr double speed = 0.5;  // m/s, of each

// Two spheres that run into each other aslant, spinning.
template <class Law>
struct Impact {
  Spheres spheres;
  Scene<Law> scene;
  double substep;
  Impact(double restitution, int steps)
      : spheres{.restitution = restitution},
        scene(Comm::self(), {0.01, 0.01, 0.01}, spheres),
        substep(spheres.collision_time() / steps) {
    const double d = spheres.diameter;
    scene.place({{{0.005 - 0.52 * d, 0.005, 0.005}, {speed, 0.2, -0.1}, {50, -80, 30}, 0, d},
                 {{0.005 + 0.52 * d, 0.005, 0.005}, {-speed, 0, 0}, {0, 0, 90}, 0, d}});
    scene.dem.open_energy_account();
  }
  void advance(int substeps) { scene.advance(substeps, substep); }
};

template <class Law>
class EnergyAccount : public testing::Test {};
using Laws = testing::Types<Frictionless, Coulomb, TangentialSpring>;
TYPED_TEST_SUITE(EnergyAccount, Laws);

// Without gravity nothing but the contact changes it.
TYPED_TEST(EnergyAccount, WhatContactsGiveIsTheChangeOfKineticEnergy) {
  Impact<TypeParam> impact(0.8, 20);
  const double before = impact.scene.dem.kinetic_energy();
  for (int s = 0; s < 40; ++s) {
    impact.advance(1);
    const double given = impact.scene.dem.energy_account().given;
    EXPECT_NEAR(given, impact.scene.dem.kinetic_energy() - before, 1e-13 * before) << s;  // round-off of some ten sums
  }
  EXPECT_LT(impact.scene.dem.energy_account().given, -0.1 * before);  // it has bounced
}

// At every moment of an impact without loss kinetic and stored energy add up to the same; symplectic Euler's error is of the
// order ω dt/2 = π/2/steps of the energy that comes and goes, here less than half of it all.
TYPED_TEST(EnergyAccount, WhatIsNotMovingIsStored) {
  constexpr int steps = 400;
  Impact<TypeParam> impact(1, steps);
  if constexpr (std::is_same_v<TypeParam, Coulomb>) GTEST_SKIP() << "sliding friction loses energy whatever the restitution";
  const double all = impact.scene.dem.kinetic_energy();
  double most = 0;
  for (int s = 0; s < 2 * steps; ++s) {
    impact.scene.dem.open_energy_account();
    const double moving = impact.scene.dem.kinetic_energy();
    impact.advance(1);
    const double stored = impact.scene.dem.energy_account().stored;
    most = std::max(most, stored);
    if constexpr (std::is_same_v<TypeParam, Frictionless>) {
      EXPECT_NEAR(moving + stored, all, 0.5 * std::numbers::pi / steps * all) << s;
    }
    // its dashpot along the surface is that of the normal law, none at e = 1; sliding loses
    EXPECT_LT(moving + stored, (1 + 0.5 * std::numbers::pi / steps) * all) << s;
  }
  EXPECT_GT(most, 0.5 * impact.spheres.mass() * speed * speed);  // about all of the motion along the normal
}

// A head-on bounce leaves e² of the energy.
TEST(EnergyAccounts, OfABounceAreItsRestitution) {
  for (const double e : {0.5, 0.8, 0.95}) {
    Spheres spheres{.restitution = e};
    Scene<Frictionless> scene(Comm::self(), {0.01, 0.01, 0.01}, spheres);
    const double d = spheres.diameter;
    scene.place({{{0.005 - 0.5001 * d, 0.005, 0.005}, {speed, 0, 0}, {}, 0, d},
                 {{0.005 + 0.5001 * d, 0.005, 0.005}, {-speed, 0, 0}, {}, 0, d}});
    scene.dem.open_energy_account();
    const double before = scene.dem.kinetic_energy();
    scene.advance(1500, spheres.collision_time() / 1000);
    EXPECT_NEAR(scene.dem.energy_account().given, (e * e - 1) * before, 2e-3 * before);  // first order at 1000 steps
  }
}

// A plate that swings against a sphere does the work that the sphere has afterwards, and more where the contact loses some.
TEST(EnergyAccounts, LeaveOutTheWorkOfWallsThatMove) {
  for (const double e : {1.0, 0.6}) {
    Spheres spheres{.restitution = e};
    spheres.walls = {{"plate", Plane{{1, 0, 0}, 0.002}, Translation{{0.8, 0, 0}}}};
    Scene<Frictionless> scene(Comm::self(), {0.01, 0.01, 0.01}, spheres);
    scene.place({{{0.0027, 0.005, 0.005}, {}, {}, 0, spheres.diameter}});
    scene.dem.open_energy_account();
    const double dt = spheres.contact().collision_time(spheres.mass()) / 1000;
    for (int s = 0; s < 3000; ++s) scene.advance(1, dt, s * dt);
    const double v = (1 + e) * 0.8, after = 0.5 * spheres.mass() * v * v;  // in the plate's frame it comes with 0.8 m/s
    EXPECT_NEAR(scene.dem.kinetic_energy(), after, 5e-3 * after);
    const double lost = 0.5 * spheres.mass() * 0.8 * 0.8 * (1 - e * e);
    EXPECT_NEAR(scene.dem.energy_account().given, -lost, 5e-3 * after);
  }
}

}  // namespace
}  // namespace bedflow
