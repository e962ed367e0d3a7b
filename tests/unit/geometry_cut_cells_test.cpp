#include <gtest/gtest.h>

#include <numbers>

#include "geometry/cut_cells.h"
#include "support/shapes.h"

namespace bedflow {
namespace {

double area(const std::vector<Facet>& facets) {
  double sum = 0;
  for (const Facet& f : facets) sum += 0.5 * norm(cross(f.corners[1] - f.corners[0], f.corners[2] - f.corners[0]));
  return sum;
}

TEST(CutCells, AWallAlongTheGridHasAFacetACell) {
  const auto facets = cut_cells(Plane{{0, 1, 0}, 0.35}, {10, 10, 10}, {0.1, 0.1, 0.1});
  EXPECT_EQ(facets.size(), 200U);       // two triangles each
  EXPECT_NEAR(area(facets), 1, 1e-10);  // neighbours overlap by the slack of 1e-12 that closes the seams
}

// The section of a box with x + 2y + 2z = 2.5: the facets cover it once, without holes.
TEST(CutCells, FacetsCoverThePlaneOnce) {
  const Vec3 normal = 1 / 3.0 * Vec3{1, 2, 2};
  const auto facets = cut_cells(Plane{normal, 2.5 / 3}, {7, 9, 11}, {1.0 / 7, 1.0 / 9, 1.0 / 11});
  // Over (x, z): y = (2.5 − x − 2z)/2 lies in [0, 1] for 0.5 − x ≤ 2z ≤ 2.5 − x: 1 − 1/16 − 1/16; times 1/n_y.
  EXPECT_NEAR(area(facets), (1 - 1.0 / 16 - 1.0 / 16) * 1.5, 1e-10);
}

// The contacts of the analytic plane to round-off, whatever the number of facets met.
TEST(CutCells, ATiltedPlaneCutByTheGridIsThePlane) {
  RandomVectors random(23);
  std::size_t most = 0;
  for (int n = 0; n < 20; ++n) {
    const Vec3 normal = random.direction();
    const Plane plane{normal, dot(normal, Vec3{0.5, 0.5, 0.5})};
    const Mesh mesh(cut_cells(plane, {16, 16, 16}, {1.0 / 16, 1.0 / 16, 1.0 / 16}));
    for (int k = 0; k < 200; ++k) {
      Vec3 way = cross(normal, random.direction());
      const double radius = random.within(0.02, 0.15), depth = random.within(0.001, 0.3);
      const Vec3 x = Vec3{0.5, 0.5, 0.5} + 0.25 * way + (1 - depth) * radius * normal;
      std::vector<std::uint32_t> near;
      mesh.near(x, radius, near);
      most = std::max(most, near.size());
      const auto found = contacts(mesh, x, radius);
      ASSERT_EQ(found.size(), 1U);
      EXPECT_NEAR(found[0].distance, (1 - depth) * radius, 5e-15);
      EXPECT_LE(norm(found[0].normal - normal), 1e-12);  // round-off of corners over the smallest distance
    }
  }
  EXPECT_GT(most, 50U);
}

TEST(CutCells, ACylindersFacetsConvergeAtSecondOrder) {
  const Revolved tube = Revolved::cylinder({0.5, 0.5, -1}, {0.5, 0.5, 2}, 0.4, false);
  const double ball = 0.1;
  std::vector<double> errors, turns;
  for (const int cells : {10, 20, 40, 80}) {
    const double h = 1.0 / cells;
    const Mesh mesh(cut_cells(tube, {cells, cells, 4}, {h, h, 0.25}));
    RandomVectors random(29);
    double error = 0, turned = 0;
    for (int n = 0; n < 2000; ++n) {
      const double turn = random.within(0, 2 * std::numbers::pi);
      const Vec3 x{0.5 + 0.31 * std::cos(turn), 0.5 + 0.31 * std::sin(turn), random.within(0.3, 0.7)};
      const auto found = contacts(mesh, x, ball), exact = contacts(tube, x, ball);
      ASSERT_EQ(found.size(), 1U);
      error = std::max(error, std::abs(found[0].distance - exact[0].distance));
      turned += dot(found[0].normal - exact[0].normal, found[0].normal - exact[0].normal) / 2000;
    }
    EXPECT_LE(error, 0.25 * h * h / 0.4 * 1.01) << "the sagitta over half a cell's diagonal";
    errors.push_back(error);
    turns.push_back(std::sqrt(turned));
  }
  for (std::size_t k = 1; k < errors.size(); ++k) {
    EXPECT_GT(std::log2(errors[k - 1] / errors[k]), 1.7) << k;  // the largest of random places: near 2 on the mean
  }
  EXPECT_GT(std::log2(errors.front() / errors.back()) / 3, 1.9);
  EXPECT_GT(std::log2(turns.front() / turns.back()) / 3, 0.9);  // the normal of a flat facet: first order in the mean
}

}  // namespace
}  // namespace bedflow
