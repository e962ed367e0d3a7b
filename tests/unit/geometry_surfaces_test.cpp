#include <gtest/gtest.h>

#include <numbers>

#include "support/shapes.h"

namespace bedflow {
namespace {

constexpr double round_off = 1e-14;  // against lengths of about 1 m

void expect_near(Vec3 a, Vec3 b, double tolerance = round_off) {
  EXPECT_LE(norm(a - b), tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") is not (" << b.x << ", " << b.y << ", "
                                    << b.z << ")";
}

// What holds for every contact: the wall's point, and the unit normal from it to the centre.
void expect_consistent(const Touch& touch, Vec3 x, double reach) {
  EXPECT_LT(touch.distance, reach);
  EXPECT_NEAR(norm(touch.normal), 1, round_off);
  expect_near(touch.point + touch.distance * touch.normal, x, 2 * round_off);
}

TEST(Plane, OneContactAtTheFootOfThePerpendicular) {
  const Vec3 normal{0.6, 0.8, 0};
  const Plane plane{normal, 0.1};
  const Vec3 foot{0.06 + 0.8, 0.08 - 0.6, 0.3};
  const auto found = contacts(plane, foot + 0.02 * normal, 0.03);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].distance, 0.02, round_off);
  expect_near(found[0].point, foot);
  EXPECT_EQ(found[0].normal, normal);
  EXPECT_TRUE(contacts(plane, foot + 0.04 * normal, 0.03).empty());
  EXPECT_FALSE(plane.passed(foot + 0.001 * normal));
  EXPECT_TRUE(plane.passed(foot - 0.001 * normal));
}

TEST(Box, FromInsideEachFaceWithinReachIsAContact) {
  const Box box{{0, 0, 0}, {1, 2, 3}, Keep::inside};
  EXPECT_EQ(contacts(box, {0.5, 1, 1.5}, 0.1).size(), 0U);
  EXPECT_EQ(contacts(box, {0.05, 1, 1.5}, 0.1).size(), 1U);
  EXPECT_EQ(contacts(box, {0.05, 1.92, 1.5}, 0.1).size(), 2U);
  const auto corner = contacts(box, {0.05, 1.92, 2.94}, 0.1);
  ASSERT_EQ(corner.size(), 3U);
  EXPECT_EQ(corner[0].normal, (Vec3{1, 0, 0}));
  EXPECT_EQ(corner[1].normal, (Vec3{0, 0, -1}));
  EXPECT_EQ(corner[2].normal, (Vec3{0, -1, 0}));
  EXPECT_NEAR(corner[1].distance, 0.06, round_off);
  EXPECT_FALSE(box.passed({0.05, 1, 1}));
  EXPECT_TRUE(box.passed({-0.05, 1, 1}));
}

TEST(Box, FromOutsideOneContactOnAFaceAnEdgeOrACorner) {
  const Box box{{0, 0, 0}, {1, 1, 1}, Keep::outside};
  const auto face = contacts(box, {1.05, 0.3, 0.4}, 0.1);
  ASSERT_EQ(face.size(), 1U);
  expect_near(face[0].point, {1, 0.3, 0.4});
  const auto edge = contacts(box, {1.03, 1.04, 0.4}, 0.1);
  ASSERT_EQ(edge.size(), 1U);
  EXPECT_NEAR(edge[0].distance, 0.05, round_off);
  expect_near(edge[0].normal, {0.6, 0.8, 0});
  const auto corner = contacts(box, {1.02, 1.02, 1.01}, 0.1);
  ASSERT_EQ(corner.size(), 1U);
  EXPECT_NEAR(corner[0].distance, 0.03, round_off);
  expect_near(corner[0].point, {1, 1, 1});
  EXPECT_TRUE(box.passed({0.5, 0.5, 0.5}));
  EXPECT_FALSE(box.passed({1.5, 0.5, 0.5}));
}

// A tilted tube: the distance to its wall is |R − ρ|, from inside and from outside.
TEST(Cylinder, ContactIsRadialFromInsideAndOutside) {
  const Vec3 from{0.1, 0.2, 0.3}, axis = 1 / std::sqrt(14.0) * Vec3{1, 2, 3}, across = 1 / std::sqrt(5.0) * Vec3{2, -1, 0};
  const Revolved tube = Revolved::cylinder(from, from + axis, 0.25, false);
  for (const double radius : {0.2, 0.3}) {
    const Vec3 x = from + 0.4 * axis + radius * across;
    const auto found = contacts(tube, x, 0.1);
    ASSERT_EQ(found.size(), 1U) << radius;
    expect_consistent(found[0], x, 0.1);
    EXPECT_NEAR(found[0].distance, 0.05, round_off);
    expect_near(found[0].normal, (radius < 0.25 ? -1.0 : 1.0) * across);
  }
  EXPECT_FALSE(tube.passed(from + 0.5 * across));  // an open tube cannot tell
}

TEST(Cylinder, TheEndOfAnOpenTubeIsARim) {
  const Revolved tube = Revolved::cylinder({0, 0, 0}, {0, 1, 0}, 0.25, false);
  const auto found = contacts(tube, {0.28, 1.04, 0}, 0.1);
  ASSERT_EQ(found.size(), 1U);
  expect_near(found[0].normal, {0.6, 0.8, 0});
  expect_near(found[0].point, {0.25, 1, 0});
}

TEST(Cylinder, AVesselHasTwoContactsWhereWallAndBottomMeetAndARodOne) {
  const Revolved vessel = Revolved::cylinder({0, 0, 0}, {0, 1, 0}, 0.25, true, Keep::inside);
  const Vec3 corner{0.21, 0.03, 0};
  const auto inside = contacts(vessel, corner, 0.05);
  ASSERT_EQ(inside.size(), 2U);
  expect_near(inside[0].normal, {0, 1, 0});
  expect_near(inside[1].normal, {-1, 0, 0});
  const auto outside = contacts(vessel, {0.28, -0.04, 0}, 0.06);
  ASSERT_EQ(outside.size(), 1U);
  expect_near(outside[0].normal, {0.6, -0.8, 0});
  EXPECT_EQ(contacts(vessel, {0, 0.03, 0}, 0.05).size(), 1U);  // on the axis the bottom is met once
  EXPECT_FALSE(vessel.passed({0.2, 0.5, 0.1}));
  EXPECT_TRUE(vessel.passed({0.2, 0.5, 0.2}));
  EXPECT_TRUE(vessel.passed({0, -0.1, 0}));
}

// In the half plane of the profile a cone is a line: distance to it in closed form.
TEST(Cone, ContactIsAcrossTheGenerator) {
  const Revolved hopper = Revolved::cone({0, 0, 0}, {0, 0.4, 0}, 0.1, 0.4, false);  // rises 0.4 over 0.3: slope 4 : 3
  RandomVectors random(7);
  for (int n = 0; n < 200; ++n) {
    const double turn = random.within(0, 2 * std::numbers::pi), along = random.within(0.1, 0.4), away = random.within(0, 0.03);
    const double side = n % 2 == 0 ? 1 : -1;
    const double radius = 0.1 + 0.6 * along - side * 0.8 * away, height = 0.8 * along + side * 0.6 * away;
    const Vec3 x{radius * std::cos(turn), height, radius * std::sin(turn)};
    const auto found = contacts(hopper, x, 0.05);
    ASSERT_EQ(found.size(), 1U);
    expect_consistent(found[0], x, 0.05);
    EXPECT_NEAR(found[0].distance, away, round_off);
    expect_near(found[0].normal, {-side * 0.8 * std::cos(turn), side * 0.6, -side * 0.8 * std::sin(turn)},
                1e-13);  // over ρ ≥ 0.1
  }
}

// A sphere in the tip touches both sides; the sum of its overlaps pushes along the axis only, smoothly through the middle.
TEST(Cone, InTheTipTheForceHasNoJumpAcrossTheAxis) {
  const double half_angle = std::numbers::pi / 6, radius = 0.05;
  const Revolved cone = Revolved::cone({0, 0, 0}, {0, 1, 0}, 0, std::tan(half_angle), true, Keep::inside);
  const auto push = [&](double off) {
    Vec3 sum;
    const auto found = contacts(cone, {off, 0.99 * radius / std::sin(half_angle), 0}, radius);
    EXPECT_EQ(found.size(), 2U);
    for (const Touch& touch : found) sum += (radius - touch.distance) * touch.normal;
    return sum;
  };
  EXPECT_EQ(push(0).x, 0);
  for (const double off : {1e-12, 1e-6, 1e-4}) {
    const double slope = 2 * std::cos(half_angle) * std::cos(half_angle);  // of two springs across the generators
    EXPECT_NEAR(push(off).x, -slope * off, 1e-15);
    EXPECT_NEAR(push(-off).x, slope * off, 1e-15);
    EXPECT_NEAR(push(off).y, 2 * 0.01 * radius * std::sin(half_angle), 1e-15);
  }
  EXPECT_TRUE(cone.passed({0, -0.01, 0}));
  EXPECT_FALSE(cone.passed({0, 0.01, 0}));
}

// Silo: cylinder, cone and outlet as one profile. At the concave knee one contact a side where it is sharp.
TEST(Revolved, AProfileOfSeveralLinesIsOneWall) {
  const Revolved silo({0, 0, 0}, {0, 1, 0}, {{0.02, 0}, {0.1, 0.08}, {0.1, 0.3}});
  EXPECT_EQ(contacts(silo, {0.07, 0.2, 0}, 0.035).size(), 1U);
  const double radius = 0.02;  // touching both: ρ = 0.1 − r, and √½ (z − ρ + 0.02) = r
  const Vec3 knee{0.1 - radius, 0.08 + radius * (std::sqrt(2.0) - 1), 0};
  const auto found = contacts(silo, knee, 1.001 * radius);
  ASSERT_EQ(found.size(), 2U);
  for (const Touch& touch : found) EXPECT_NEAR(touch.distance, radius, round_off);
  // In the outlet between the two edges of the rim: across the opening, both sides.
  EXPECT_EQ(contacts(silo, {0, -0.001, 0}, 0.0201).size(), 2U);
}

TEST(Revolved, BoundsHoldTheSurfaceAndTouchIt) {
  RandomVectors random(11);
  for (int n = 0; n < 20; ++n) {
    const Vec3 from = random.within({-1, -1, -1}, {1, 1, 1}), to = from + random.within(0.5, 2) * random.direction();
    const double r0 = random.within(0.1, 1), r1 = random.within(0.1, 1);
    const Revolved cone = Revolved::cone(from, to, r0, r1, true);
    const Bounds bounds = cone.bounds();
    Vec3 low{9, 9, 9}, high{-9, -9, -9};
    const Vec3 axis = 1 / norm(to - from) * (to - from);
    Vec3 u = cross(axis, random.direction());
    u *= 1 / norm(u);
    const Vec3 v = cross(axis, u);
    for (int k = 0; k < 720; ++k)
      for (const auto& [middle, radius] : {std::pair{from, r0}, std::pair{to, r1}}) {
        const double turn = k * std::numbers::pi / 360;
        const Vec3 p = middle + radius * std::cos(turn) * u + radius * std::sin(turn) * v;
        for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], p[d]), high[d] = std::max(high[d], p[d]);
      }
    // 720 points of a ring miss its extreme by at most R (π/720)²/2.
    expect_near(bounds.low, low, 5e-5);
    expect_near(bounds.high, high, 5e-5);
    for (int d = 0; d < 3; ++d) EXPECT_TRUE(bounds.low[d] <= low[d] + round_off && bounds.high[d] >= high[d] - round_off);
  }
}

}  // namespace
}  // namespace bedflow
