// Limits of stability of the particles' motion: measured by bisection, against theory. Prints the table.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "support/dem_scene.h"

namespace bedflow {
namespace {

// The share of the theoretical limit up to which it is stable, to 0.001.
double measured_share(const std::function<bool(double)>& is_stable) {
  double stable = 0.5, unstable = 1.5;
  EXPECT_TRUE(is_stable(stable));
  EXPECT_FALSE(is_stable(unstable));
  while (unstable - stable > 1e-3) {
    const double middle = 0.5 * (stable + unstable);
    (is_stable(middle) ? stable : unstable) = middle;
  }
  return 0.5 * (stable + unstable);
}

void print(const char* what, const char* theory, double share) {
  std::printf("  %-44s %-28s stable up to %.3f of it\n", what, theory, share);
}

// An elastic sphere pressed between two walls: ω² = 2k/m. Near the limit its swing is magnified by 1/sqrt(1 − share²), 22 at
// 0.999; just beyond, it grows by e^0.09 a sub-step.
TEST(Limits, OfTheContactIntegratorIsThatOfTheOscillator) {
  Spheres spheres{.stiffness = 500, .restitution = 1, .friction = 0};
  const double d = spheres.diameter, limit = 2 / std::sqrt(2 * spheres.stiffness / spheres.mass());
  const double share = measured_share([&](double trial) {
    const Vec3 box{0.9 * d, 4 * d, 4 * d};
    Scene<Frictionless> scene(Comm::self(), box, spheres, {1, 1, 1});
    const double offset = 1e-9 * d;
    scene.place({{0.5 * box + Vec3{offset, 0, 0}, {}, d, 0}});
    for (int pass = 0; pass < 20; ++pass) {
      scene.advance(100, trial * limit);
      const double swing = std::abs(scene.dem.particles().position(0).x - 0.5 * box.x);
      if (!(swing < 100 * offset) || scene.dem.failure()) return false;
    }
    return true;
  });
  print("contact, symplectic Euler", "dt = 2/omega", share);
  EXPECT_NEAR(share, 1, 2e-3);  // twice the bisection's width
}

// A force b (U − V) that is frozen over a gas step: V − U is multiplied by 1 − b dt/m.
TEST(Limits, OfExplicitDragIsTwoMassesOverB) {
  Spheres spheres{.skin = 1e-4, .sides = {Side::periodic, Side::periodic, Side::periodic}};
  const double d = spheres.diameter, b = 1e-3, limit = 2 * spheres.mass() / b;
  const double share = measured_share([&](double trial) {
    Scene<Frictionless> scene(Comm::self(), {8 * d, 8 * d, 8 * d}, spheres, {1, 1, 1}, true);
    scene.place({{{4 * d, 4 * d, 4 * d}, {1e-9, 0, 0}, d, 0}});
    constexpr int substeps = 5;
    for (int step = 0; step < 4000; ++step) {
      const double slip = -scene.dem.particles().velocity(0).x;  // U = 0
      scene.dem.particles().gas_force[0] = {b * slip, 0, 0};
      scene.advance(substeps, trial * limit / substeps);
      if (!(std::abs(slip) < 1e-8) || scene.dem.failure()) return false;
    }
    return true;
  });
  print("drag, frozen over the gas step", "dt = 2m/b", share);
  EXPECT_NEAR(share, 1, 2e-3);
}

}  // namespace
}  // namespace bedflow
