#include <gtest/gtest.h>

#include <numbers>

#include "support/shapes.h"

namespace bedflow {
namespace {

const Vec3 axis = 1 / std::sqrt(14.0) * Vec3{1, 2, 3};

std::vector<Motion> motions() {
  return {Still{}, Translation{{0.3, -0.2, 0.1}}, Rotation{{0.1, 0.2, 0.3}, axis, 2.5}, Vibration{{0.01, 0.02, -0.01}, 15, 0.7},
          Course{{{0, {0, 0, 0}}, {1, {0.5, 0, 0}}, {3, {0.5, -0.4, 0.2}}}}};
}
Pose pose(const Motion& motion, double time) {
  return std::visit([&](const auto& kind) { return kind.pose(time); }, motion);
}

TEST(Motion, VelocityIsTheDerivativeOfThePlace) {
  const Vec3 body{0.7, -0.3, 0.2};
  const double h = 1e-5;
  for (const Motion& motion : motions())
    for (const double time : {0.123, 0.777, 2.2}) {
      const Vec3 x = pose(motion, time).to_world(body);
      const Vec3 numeric = 1 / (2 * h) * (pose(motion, time + h).to_world(body) - pose(motion, time - h).to_world(body));
      // Central difference: h²/6 times the third derivative (2π·15)³ · 0.025 of the vibration, and round-off 1e-16/h.
      EXPECT_LE(norm(pose(motion, time).velocity_at(x) - numeric), 5e-7) << motion.index();
    }
}

TEST(Motion, APoseIsRigidAndInvertible) {
  RandomVectors random(17);
  for (const Motion& motion : motions())
    for (int n = 0; n < 50; ++n) {
      const double time = random.within(-1, 1e4);
      const Pose at = pose(motion, time);
      const Vec3 a = random.within({-1, -1, -1}, {1, 1, 1}), b = random.within({-1, -1, -1}, {1, 1, 1});
      EXPECT_NEAR(norm(at.to_world(a) - at.to_world(b)), norm(a - b), 1e-11);  // round-off at shifts of 4000 m
      EXPECT_LE(norm(at.to_body(at.to_world(a)) - a), 1e-11);
      EXPECT_LE(norm(at.turned_back(at.turned(a)) - a), 1e-14);
    }
}

TEST(Motion, AQuarterTurnIsAQuarterTurn) {
  const Rotation rotation{{1, 0, 0}, {0, 0, 1}, std::numbers::pi / 2};
  const Vec3 x = rotation.pose(1).to_world({3, 0, 0.5});
  EXPECT_LE(norm(x - Vec3{1, 2, 0.5}), 1e-15);
  EXPECT_LE(norm(rotation.pose(1).velocity_at(x) - Vec3{-std::numbers::pi, 0, 0}), 1e-15);
}

TEST(Motion, ATableIsHeldAtBothEnds) {
  const Course course{{{1, {1, 0, 0}}, {2, {1, 2, 0}}}};
  EXPECT_EQ(course.pose(0.5).shift, (Vec3{1, 0, 0}));
  EXPECT_EQ(course.pose(0.5).velocity, Vec3{});
  EXPECT_EQ(course.pose(1).velocity, (Vec3{0, 2, 0}));
  EXPECT_EQ(course.pose(1.5).shift, (Vec3{1, 1, 0}));
  EXPECT_EQ(course.pose(2).shift, (Vec3{1, 2, 0}));
  EXPECT_EQ(course.pose(7).velocity, Vec3{});
}

TEST(Motion, NoPointMovesFurtherThanTheBound) {
  const Bounds bounds{{-0.5, 0, 0.2}, {1, 0.7, 0.9}};
  RandomVectors random(19);
  for (const Motion& motion : motions()) {
    double tightest = 1e9;
    for (int n = 0; n < 300; ++n) {
      const double from = random.within(0, 4), to = random.within(0, 4), bound = farthest_move(motion, from, to, bounds);
      double farthest = 0;
      for (int k = 0; k < 200; ++k) {
        Vec3 body = random.within(bounds.low, bounds.high);
        if (k < 8)
          for (int d = 0; d < 3; ++d) body[d] = (k >> d & 1) != 0 ? bounds.low[d] : bounds.high[d];
        farthest = std::max(farthest, norm(pose(motion, to).to_world(body) - pose(motion, from).to_world(body)));
      }
      EXPECT_LE(farthest, bound + 1e-14);
      EXPECT_LE(bound, fastest_speed(motion, bounds) * std::abs(to - from) + 1e-14);
      tightest = std::min(tightest, bound - farthest);
    }
    EXPECT_LE(tightest, 1e-14) << "the bound is reached by a corner";
  }
}

TEST(Motion, TheFastestSpeedIsReached) {
  const Bounds bounds{{-0.5, 0, 0.2}, {1, 0.7, 0.9}};
  for (const Motion& motion : motions()) {
    double fastest = 0;
    for (int n = 0; n < 3000; ++n) fastest = std::max(fastest, farthest_move(motion, 1e-3 * n, 1e-3 * n + 1e-7, bounds) / 1e-7);
    EXPECT_NEAR(fastest, fastest_speed(motion, bounds), 2e-3 * fastest);  // of 67 phases of a vibration one is near the middle
  }
}

TEST(Motion, ADrumAndABeltSlideAlongThemselves) {
  const Revolved drum = Revolved::cylinder({0.1, 0.2, 0.3}, Vec3{0.1, 0.2, 0.3} + axis, 0.2, true);
  const Plane belt{{0, 1, 0}, 0.1};
  EXPECT_TRUE(slides_along_itself(drum, Rotation{Vec3{0.1, 0.2, 0.3} + 0.4 * axis, -axis, 3}));
  EXPECT_FALSE(slides_along_itself(drum, Rotation{{0.1, 0.2, 0.4}, axis, 3}));
  EXPECT_FALSE(slides_along_itself(drum, Rotation{{0.1, 0.2, 0.3}, {0, 1, 0}, 3}));
  EXPECT_FALSE(slides_along_itself(drum, Translation{{1, 0, 0}}));
  EXPECT_TRUE(slides_along_itself(belt, Translation{{1, 0, 2}}));
  EXPECT_FALSE(slides_along_itself(belt, Translation{{1, 1e-6, 0}}));
  EXPECT_TRUE(slides_along_itself(belt, Rotation{{5, 0, 0}, {0, -1, 0}, 1}));
  EXPECT_TRUE(slides_along_itself(drum, Still{}));
  EXPECT_FALSE(slides_along_itself(belt, Vibration{{1, 0, 0}, 1, 0}));
}

}  // namespace
}  // namespace bedflow
