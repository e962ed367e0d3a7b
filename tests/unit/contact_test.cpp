#include <gtest/gtest.h>

#include <numbers>

#include "geometry/plane.h"
#include "models/tangential.h"

namespace bedflow {
namespace {

// τ and η of four beds, computed independently (six and five digits were written down).
TEST(Contact, CollisionTimeAndDampingAreThoseOfTheBeds) {
  struct Bed {
    double mass, stiffness, restitution, damping, time;
  };
  for (const Bed& bed :
       {Bed{2.0419e-05, 2519, 0.97, 3.10951e-03, 2.0001e-04}, Bed{9.0478e-07, 440, 0.97, 2.73565e-04, 1.0074e-04},
        Bed{8.7212e-05, 43000, 0.97, 2.65513e-02, 1.0005e-04}, Bed{2.0442e-05, 1000, 0.84, 1.12043e-02, 3.1810e-04}}) {
    const auto law = LinearSpringDashpot::from_restitution(bed.stiffness, bed.restitution, bed.mass / 2);
    EXPECT_NEAR(law.damping, bed.damping, 3e-5 * bed.damping);
    EXPECT_NEAR(law.collision_time(bed.mass / 2), bed.time, 5e-5 * bed.time);
  }
}

// The exact half period of the damped oscillator, δ = v/ω e^(−λt) sin ωt, leaves with e v.
TEST(Contact, HalfPeriodOfTheDampedOscillatorReturnsTheRestitution) {
  const double mass = 2e-5, stiffness = 1000;
  for (const double e : {0.1, 0.5, 0.97, 1.0}) {
    const auto law = LinearSpringDashpot::from_restitution(stiffness, e, mass);
    EXPECT_NEAR(std::exp(-law.damping / (2 * mass) * law.collision_time(mass)), e, 1e-14);
  }
}

TEST(Contact, NormalForceIsNotClippedToRepulsion) {
  const LinearSpringDashpot law{1000, 0.01};
  EXPECT_DOUBLE_EQ(law(1e-4, 0), 0.1);
  EXPECT_LT(law(1e-6, -1), 0);
}

Sliding sliding(Vec3 velocity, double normal_force) {
  return {{0, 0, 1}, velocity, normal_force, 2e-7, 1e-5};
}

TEST(Coulomb, ForceIsFrictionTimesNormalForceAgainstTheSliding) {
  const Vec3 force = Coulomb{0.3}(sliding({3, -4, 0}, 0.01));
  EXPECT_NEAR(force.x, -0.3 * 0.01 * 0.6, 1e-17);
  EXPECT_NEAR(force.y, 0.3 * 0.01 * 0.8, 1e-17);
  EXPECT_EQ(force.z, 0);
}

TEST(Coulomb, OneSubStepsImpulseStopsButNeverReversesTheSliding) {
  for (const double speed : {1e-12, 1e-6, 1e-3, 1.0}) {
    const Sliding s = sliding({speed, 0, 0}, 10);
    const double after = speed + Coulomb{0.5}(s).x * s.dt / s.mass;
    EXPECT_GE(after, -1e-15 * speed) << speed;
    EXPECT_LT(after, speed);
  }
}

TEST(Coulomb, NothingSlidesNothingRubs) {
  EXPECT_EQ(Coulomb{0.5}(sliding({0, 0, 0}, 10)), Vec3{});
  EXPECT_EQ(Coulomb{0.5}(sliding({0, 0, 0}, 0)), Vec3{});
}

TEST(TangentialSpring, SticksAsSpringAndDashpotBelowTheLimit) {
  const TangentialSpring law{0.5, 100, 0.01};
  Vec3 displacement{1e-6, 0, 0};
  const Sliding s = sliding({0.02, 0.01, 0}, 10);
  const Vec3 force = law(s, displacement);
  EXPECT_NEAR(displacement.x, 1e-6 + 0.02e-5, 1e-21);
  EXPECT_NEAR(displacement.y, 0.01e-5, 1e-21);
  EXPECT_NEAR(force.x, -100 * 1.2e-6 - 0.01 * 0.02, 1e-18);
  EXPECT_NEAR(force.y, -100 * 1e-7 - 0.01 * 0.01, 1e-18);
}

TEST(TangentialSpring, SlipSetsTheSpringBackToWhatGivesTheForce) {
  const TangentialSpring law{0.2, 100, 0.01};
  Vec3 displacement{1e-3, 1e-3, 0};
  const Sliding s = sliding({0.02, 0.01, 0}, 0.01);
  const Vec3 force = law(s, displacement);
  EXPECT_NEAR(norm(force), 0.2 * 0.01, 1e-17);
  const Vec3 spring = -100 * displacement - 0.01 * s.velocity;
  EXPECT_NEAR(norm(spring - force), 0, 1e-17);
  EXPECT_LT(norm(displacement), 1e-4);  // the old spring is forgotten
}

TEST(TangentialSpring, TheSpringTurnsWithTheContactAndKeepsItsLength) {
  const TangentialSpring law{1e9, 100, 0};
  Vec3 displacement{1e-5, 2e-5, 0};
  const double length = norm(displacement);
  for (int i = 1; i <= 90; ++i) {  // the pair rolls as a whole through a right angle
    const double angle = i * std::numbers::pi / 180;
    Sliding s = sliding({}, 1);
    s.normal = {std::sin(angle), 0, std::cos(angle)};
    law(s, displacement);
    EXPECT_NEAR(dot(displacement, s.normal), 0, 1e-18);
    EXPECT_NEAR(norm(displacement), length, 1e-16 * i * length + 1e-20);
  }
}

TEST(TangentialSpring, ZeroDisplacementAndZeroSlidingGiveZeroForce) {
  Vec3 displacement;
  EXPECT_EQ((TangentialSpring{0.5, 100, 0.01}(sliding({}, 0), displacement)), Vec3{});
  EXPECT_EQ(displacement, Vec3{});
}

TEST(Plane, FacesOfTheBoxLookInward) {
  const auto faces = box_faces({1, 2, 3});
  for (int face = 0; face < 6; ++face) {
    const double expected[] = {0.25, 0.75, 0.5, 1.5, 1, 2};
    EXPECT_DOUBLE_EQ(faces[face].distance({0.25, 0.5, 1}), expected[face]);
  }
}

}  // namespace
}  // namespace bedflow
