#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "geometry/plane.h"
#include "models/cohesion.h"
#include "models/rolling.h"
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
    const auto law = LinearSpringDashpot::from_restitution(bed.stiffness, bed.restitution);
    EXPECT_NEAR(law.damping(bed.mass / 2), bed.damping, 3e-5 * bed.damping);
    EXPECT_NEAR(law.collision_time(bed.mass / 2), bed.time, 5e-5 * bed.time);
  }
}

// The exact half period of the damped oscillator, δ = v/ω e^(−λt) sin ωt, leaves with e v.
TEST(Contact, HalfPeriodOfTheDampedOscillatorReturnsTheRestitution) {
  const double mass = 2e-5, stiffness = 1000;
  for (const double e : {0.1, 0.5, 0.97, 1.0}) {
    const auto law = LinearSpringDashpot::from_restitution(stiffness, e);
    EXPECT_NEAR(std::exp(-law.damping(mass) / (2 * mass) * law.collision_time(mass)), e, 1e-14);
  }
}

TEST(Contact, NormalForceIsNotClippedToRepulsion) {
  const LinearSpringDashpot law{1000, 0.1};
  EXPECT_DOUBLE_EQ(law(Touching<double>{1e-4, 0, 1e-5, 0}), 0.1);
  EXPECT_LT(law(Touching<double>{1e-6, -1, 1e-5, 0}), 0);
}

// An impact by the law itself (Runge–Kutta 4): speed after over speed before, and how long it lasts.
template <class Law>
std::pair<double, double> impact(const Law& law, double mass, double radius, double speed, double time) {
  double overlap = 0, approach = speed, t = 0;
  const double h = time / 5000;
  const auto pull = [&](double d, double v) { return -law(Touching<double>{std::max(d, 0.0), v, mass, radius}) / mass; };
  do {
    const double a1 = pull(overlap, approach), v2 = approach + h / 2 * a1, a2 = pull(overlap + h / 2 * approach, v2),
                 v3 = approach + h / 2 * a2, a3 = pull(overlap + h / 2 * v2, v3), v4 = approach + h * a3,
                 a4 = pull(overlap + h * v3, v4);
    overlap += h / 6 * (approach + 2 * v2 + 2 * v3 + v4);
    approach += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    t += h;
  } while (overlap > 0);
  return {-approach / speed, t};
}

TEST(Hertz, ReboundsWithTheRestitutionAtEverySpeed) {
  for (const double e : {0.3, 0.8, 0.97})
    for (const double speed : {0.01, 1.0}) {
      const auto law = Hertz::from_restitution(1e7, e);
      // The last step ends up to 1/5000 of the impact after the contact.
      EXPECT_NEAR(impact(law, 1e-5, 1e-3, speed, law.collision_time(1e-5, 1e-3, speed)).first, e, 2e-5) << e;
    }
}

TEST(Hertz, AnElasticImpactLastsAsHertzFound) {
  const auto law = Hertz::from_restitution(5e8, 1);
  const double time = law.collision_time(2e-5, 5e-4, 0.3);
  EXPECT_NEAR(impact(law, 2e-5, 5e-4, 0.3, time).second, time, time / 2000);
}

TEST(Hertz, TheElasticForceIsFourThirdsOfEStarRootRDeltaToTheThreeHalves) {
  const Hertz law{1e9, 0};
  EXPECT_NEAR(law(Touching<double>{1e-6, 5, 1e-5, 1e-3}), 4.0 / 3 * 1e9 * std::sqrt(1e-3) * std::pow(1e-6, 1.5), 1e-13);
}

Sliding<double> sliding(Vec3 velocity, double normal_force) {
  return {{0, 0, 1}, velocity, normal_force, 2e-7, 1e-5, {1e-6, 0, 7e-7, 1e-3}};
}

// kt = 100 N/m, ηt = 0.01 kg/s for the contact of sliding().
TangentialSpring spring(double friction, double damping = 0.01) {
  return {friction, 100, 1, {1, damping / (2 * std::sqrt(7e-7))}};
}

TEST(Coulomb, ForceIsFrictionTimesNormalForceAgainstTheSliding) {
  const Vec3 force = Coulomb{0.3}(sliding({3, -4, 0}, 0.01));
  EXPECT_NEAR(force.x, -0.3 * 0.01 * 0.6, 1e-17);
  EXPECT_NEAR(force.y, 0.3 * 0.01 * 0.8, 1e-17);
  EXPECT_EQ(force.z, 0);
}

TEST(Coulomb, OneSubStepsImpulseStopsButNeverReversesTheSliding) {
  for (const double speed : {1e-12, 1e-6, 1e-3, 1.0}) {
    const Sliding<double> s = sliding({speed, 0, 0}, 10);
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
  const TangentialSpring law = spring(0.5);
  Vec3 displacement{1e-6, 0, 0};
  const Sliding<double> s = sliding({0.02, 0.01, 0}, 10);
  const Vec3 force = law(s, displacement);
  EXPECT_NEAR(displacement.x, 1e-6 + 0.02e-5, 1e-21);
  EXPECT_NEAR(displacement.y, 0.01e-5, 1e-21);
  EXPECT_NEAR(force.x, -100 * 1.2e-6 - 0.01 * 0.02, 1e-18);
  EXPECT_NEAR(force.y, -100 * 1e-7 - 0.01 * 0.01, 1e-18);
}

TEST(TangentialSpring, SlipSetsTheSpringBackToWhatGivesTheForce) {
  const TangentialSpring law = spring(0.2);
  Vec3 displacement{1e-3, 1e-3, 0};
  const Sliding<double> s = sliding({0.02, 0.01, 0}, 0.01);
  const Vec3 force = law(s, displacement);
  EXPECT_NEAR(norm(force), 0.2 * 0.01, 1e-17);
  const Vec3 spring = -100 * displacement - 0.01 * s.velocity;
  EXPECT_NEAR(norm(spring - force), 0, 1e-17);
  EXPECT_LT(norm(displacement), 1e-4);  // the old spring is forgotten
}

TEST(TangentialSpring, TheSpringTurnsWithTheContactAndKeepsItsLength) {
  const TangentialSpring law = spring(1e9, 0);
  Vec3 displacement{1e-5, 2e-5, 0};
  const double length = norm(displacement);
  for (int i = 1; i <= 90; ++i) {  // the pair rolls as a whole through a right angle
    const double angle = i * std::numbers::pi / 180;
    Sliding<double> s = sliding({}, 1);
    s.normal = {std::sin(angle), 0, std::cos(angle)};
    law(s, displacement);
    EXPECT_NEAR(dot(displacement, s.normal), 0, 1e-18);
    EXPECT_NEAR(norm(displacement), length, 1e-16 * i * length + 1e-20);
  }
}

TEST(TangentialSpring, ZeroDisplacementAndZeroSlidingGiveZeroForce) {
  Vec3 displacement;
  EXPECT_EQ(spring(0.5)(sliding({}, 0), displacement), Vec3{});
  EXPECT_EQ(displacement, Vec3{});
}

TEST(Mindlin, StiffnessIsTwoThirdsOfEightGStarTimesTheContactRadius) {
  const Mindlin law{1e9, 1e8, 0.2};
  Vec3 displacement{1e-7, 0, 0};
  const Sliding<double> s = sliding({0.02, 0, 0}, 10);
  const double slope = 8 * 1e8 * std::sqrt(1e-3 * 1e-6), damping = 2 * std::sqrt(5.0 / 6) * 0.2 * std::sqrt(slope * 7e-7);
  EXPECT_NEAR(law(s, displacement).x, -2.0 / 3 * slope * 3e-7 - damping * 0.02, 1e-12);
  EXPECT_NEAR(displacement.x, 3e-7, 1e-20);
}

TEST(Mindlin, SlipsAtFrictionTimesNormalForce) {
  const Mindlin law{0.3, 1e8, 0.2};
  Vec3 displacement{1e-4, 0, 0};
  EXPECT_NEAR(law(sliding({0.02, 0, 0}, 0.01), displacement).x, -0.003, 1e-17);
}

RollingContact<double> rolling(Vec3 rate) {
  return {{0, 0, 1}, rate, 0.5, 1e-12, 1e-6, {1e-6, 0, 1e-6, 1e-3}};
}

TEST(ConstantRolling, TorqueIsFrictionTimesReducedRadiusTimesNormalForce) {
  const Vec3 torque = ConstantRolling{0.02}(rolling({30, -40, 0}));
  EXPECT_NEAR(torque.x, -0.02 * 1e-3 * 0.5 * 0.6, 1e-20);
  EXPECT_NEAR(torque.y, 0.02 * 1e-3 * 0.5 * 0.8, 1e-20);
  EXPECT_EQ(ConstantRolling{0.02}(rolling({})), Vec3{});
}

TEST(ConstantRolling, OneSubStepsTorqueStopsButNeverReversesTheRolling) {
  const RollingContact<double> c = rolling({1e-9, 0, 0});
  EXPECT_NEAR(c.rate.x + ConstantRolling{0.02}(c).x * c.dt / c.inertia, 0, 1e-24);
}

TEST(SpringRolling, HoldsAsASpringAndLetsGoAtTheLimit) {
  const SpringRolling law{0.02, 1e4, 0};
  Vec3 angle;
  const double stiffness = 2.25 * 1e4 * std::pow(0.02 * 1e-3, 2);
  EXPECT_NEAR(law(rolling({10, 0, 0}), angle).x, -stiffness * 1e-5, 1e-20);
  EXPECT_NEAR(angle.x, 1e-5, 1e-20);
  angle = {100, 0, 0};
  EXPECT_NEAR(law(rolling({10, 0, 0}), angle).x, -0.02 * 1e-3 * 0.5, 1e-18);
  EXPECT_NEAR(angle.x, 0.02 * 1e-3 * 0.5 / stiffness, 1e-12);
}

TEST(VanDerWaals, FallsWithTheSquareOfTheGapToTheCutOff) {
  const VanDerWaals law{6e-19, 1e-9, 1e-7};
  EXPECT_NEAR(law(1e-8, 1e-5), 1e-19 * 1e-5 / 1e-16, 1e-22);
  EXPECT_EQ(law(-1e-6, 1e-5), law(1e-9, 1e-5));
  EXPECT_EQ(law(1.01e-7, 1e-5), 0);
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
