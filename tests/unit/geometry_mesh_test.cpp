#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "support/shapes.h"

namespace bedflow {
namespace {

// By definition: the smallest distance to a fine grid of points on the triangle is above the distance, by little.
TEST(Facet, NearestPointIsTheNearest) {
  RandomVectors random(3);
  for (int n = 0; n < 300; ++n) {
    const Vec3 low{-1, -1, -1}, high{1, 1, 1};
    const Facet facet = Facet::of({random.within(low, high), random.within(low, high), random.within(low, high)});
    const Vec3 x = random.within(2 * low, 2 * high);
    const Touch touch = facet.nearest(x);
    double best = 1e9;
    const int grid = 60;
    for (int i = 0; i <= grid; ++i)
      for (int j = 0; i + j <= grid; ++j) {
        const Vec3 p = 1.0 / grid * (i * facet.corners[0] + j * facet.corners[1] + (grid - i - j) * facet.corners[2]);
        best = std::min(best, norm(x - p));
      }
    EXPECT_LE(touch.distance, best + 1e-14);
    EXPECT_GE(touch.distance, best - 2.0 / grid);
    EXPECT_NEAR(norm(x - touch.point - touch.distance * touch.normal), 0, 1e-14);
  }
}

TEST(Facet, ASliverAndItsOwnPointsAreHarmless) {
  const Facet sliver{{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{1, 0, 0}}, {0, 1, 0}};
  const Touch touch = sliver.nearest({0.5, 0.3, 0});
  EXPECT_NEAR(touch.distance, 0.3, 1e-15);
  EXPECT_EQ(touch.normal, (Vec3{0, 1, 0}));
  const Touch on_it = sliver.nearest({0.5, 0, 0});
  EXPECT_EQ(on_it.distance, 0);
  EXPECT_EQ(on_it.normal, (Vec3{0, 1, 0}));
}

TEST(Mesh, TreeFindsWhatBruteForceFinds) {
  RandomVectors random(5);
  std::vector<Facet> facets;
  for (int n = 0; n < 2000; ++n) {
    const Vec3 middle = random.within({0, 0, 0}, {1, 1, 1});
    const double size = n % 50 == 0 ? 0.8 : 0.03;  // a few large among many small
    facets.push_back(Facet::of({middle, middle + size * random.direction(), middle + size * random.direction()}));
  }
  const Mesh mesh(facets);
  std::size_t found = 0;
  for (int n = 0; n < 1500; ++n) {
    const Vec3 x = random.within({-0.2, -0.2, -0.2}, {1.2, 1.2, 1.2});
    const double reach = random.within(0.01, 0.2);
    std::vector<std::uint32_t> near, all;
    const bool any = mesh.near(x, reach, near);
    EXPECT_EQ(any, !near.empty());
    for (std::uint32_t f = 0; f < mesh.facets().size(); ++f)
      if (mesh.facets()[f].nearest(x).distance < reach) all.push_back(f);
    std::sort(near.begin(), near.end());
    EXPECT_EQ(near, all);
    found += all.size();
  }
  EXPECT_GT(found, 10000U);  // there was something to find
}

// Over every edge, vertex and face of a tessellated, tilted plane: the plane's one contact, however many triangles are met and
// however deep the sphere sits in them.
TEST(Mesh, ASphereRolledOverATessellatedPlaneSeesThePlane) {
  const Vec3 along = 1 / 3.0 * Vec3{2, 1, 2}, across = 1 / 3.0 * Vec3{-2, 2, 1}, normal = cross(along, across);
  const Plane plane{normal, dot(normal, Vec3{0.3, 0.1, 0.2})};
  const Mesh mesh(tessellated({0.3, 0.1, 0.2}, along, across, 40, 30));
  RandomVectors random(9);
  for (int n = 0; n < 3000; ++n) {
    // A third over vertices, a third over edges, a third anywhere.
    const double i = n % 3 == 0 ? std::round(random.within(8, 32)) : random.within(8, 32);
    const double j = n % 3 != 2 ? std::round(random.within(6, 24)) : random.within(6, 24);
    const double radius = 0.1, depth = random.within(0, 0.5);
    const Vec3 x = Vec3{0.3, 0.1, 0.2} + i / 40 * along + j / 30 * across + (1 - depth) * radius * normal;
    const auto facets = contacts(mesh, x, radius), exact = contacts(plane, x, radius);
    ASSERT_EQ(facets.size(), 1U) << "over " << i << ", " << j << " at depth " << depth;
    EXPECT_NEAR(facets[0].distance, exact[0].distance, 1e-15);
    EXPECT_LE(norm(facets[0].normal - exact[0].normal), 2e-14);  // round-off of a place of 1 m over half the radius
  }
}

std::vector<Facet> corner_of(double angle) {
  // Two walls that meet at the z axis with `angle` between their normals, rising towards the sphere on either side.
  const double half = angle / 2;
  std::vector<Facet> facets = tessellated({0, 0, 0}, {std::cos(half), std::sin(half), 0}, {0, 0, 1}, 10, 10);
  const auto other = tessellated({0, 0, 0}, {-std::cos(half), std::sin(half), 0}, {0, 0, 1}, 10, 10);
  facets.insert(facets.end(), other.begin(), other.end());
  return facets;
}

TEST(Mesh, AConcaveEdgeIsTwoContactsFromTheFeatureAngleOn) {
  const double radius = 0.06;
  for (const double degrees : {2.0, 10.0, 25.0, 35.0, 60.0, 90.0, 120.0}) {
    const double angle = degrees * std::numbers::pi / 180;
    const Mesh mesh(corner_of(angle));
    const Vec3 x{0, 0.999 * radius / std::cos(angle / 2), 0.43};  // in the middle, 0.1 % deep in both
    const auto found = contacts(mesh, x, radius);
    EXPECT_EQ(found.size(), degrees < 30 ? 1U : 2U) << degrees;
    for (const Touch& touch : found) EXPECT_NEAR(touch.distance, 0.999 * radius, 1e-15);
    EXPECT_EQ(contacts(Mesh(corner_of(angle), 0.5 * angle), x, radius).size(), 2U) << "a feature angle of its own";
  }
}

TEST(Mesh, AConvexEdgeAndAVertexAreOneContact) {
  // A cube of twelve triangles each face, by its analytic twin.
  const Box box{{0, 0, 0}, {1, 1, 1}};
  std::vector<Facet> facets;
  const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  for (const auto& [corner, a, b] : {std::tuple{Vec3{}, x, y}, {z, x, y}, {Vec3{}, y, z}, {x, y, z}, {Vec3{}, z, x}, {y, z, x}}) {
    const auto face = tessellated(corner, a, b, 3, 2);
    facets.insert(facets.end(), face.begin(), face.end());
  }
  const Mesh mesh(facets);
  RandomVectors random(13);
  int touching = 0;
  for (int n = 0; n < 5000; ++n) {
    const Vec3 place = random.within({-0.1, -0.1, -0.1}, {1.1, 1.1, 1.1});
    const double radius = 0.1;
    const auto found = contacts(mesh, place, radius), exact = contacts(box, place, radius);
    if (!exact.empty() && exact[0].distance < 0.5 * radius) continue;  // no contact is that deep
    ASSERT_EQ(found.size(), exact.size());
    for (std::size_t c = 0; c < found.size(); ++c) {
      ++touching;
      EXPECT_NEAR(found[c].distance, exact[c].distance, 1e-15);
      EXPECT_LE(norm(found[c].point - exact[c].point), 1e-14);
    }
  }
  EXPECT_GT(touching, 1000);
}

// A sphere that rolls round inside a tube of n flats: one contact all the way, at the tube's distance to within its sagitta.
TEST(Mesh, InsideATubeOfFlatsThereIsOneContact) {
  const int flats = 48;
  const double radius = 0.5, ball = 0.1;
  std::vector<Facet> facets;
  for (int k = 0; k < flats; ++k) {
    const auto at = [&](int n) {
      const double turn = 2 * std::numbers::pi * n / flats;
      return Vec3{radius * std::cos(turn), radius * std::sin(turn), 0};
    };
    const auto strip = tessellated(at(k), at(k + 1) - at(k), {0, 0, 1}, 2, 20);
    facets.insert(facets.end(), strip.begin(), strip.end());
  }
  const Mesh mesh(facets);
  const double sagitta = radius * (1 - std::cos(std::numbers::pi / flats));
  for (int n = 0; n < 4800; ++n) {
    const double turn = 2 * std::numbers::pi * n / 4800;
    const Vec3 x = Vec3{0, 0, 0.5} + (radius - 0.95 * ball) * Vec3{std::cos(turn), std::sin(turn), 0};
    const auto found = contacts(mesh, x, ball);
    ASSERT_EQ(found.size(), 1U) << n;
    EXPECT_GE(found[0].distance, 0.95 * ball - sagitta - 1e-14);
    EXPECT_LE(found[0].distance, 0.95 * ball + 1e-14);
  }
}

}  // namespace
}  // namespace bedflow
