// The lid-driven cavity at Re 100, 400 and 1000 against Ghia, Ghia and Shin (1982): data/ghia1982_cavity.csv.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <vector>

#include "gas_box.h"

namespace bedflow {
namespace {

struct Point {
  char component;
  double s, value;
};

std::vector<Point> ghia(int reynolds) {
  const int column = reynolds == 100 ? 2 : reynolds == 400 ? 3 : 4;
  std::ifstream file(BEDFLOW_SOURCE_DIR "/tests/verification/data/ghia1982_cavity.csv");
  std::vector<Point> points;
  for (std::string line; std::getline(file, line);) {
    if (line[0] != 'u' && line[0] != 'v') continue;
    std::istringstream fields(line);
    std::array<std::string, 5> cell;
    for (std::string& text : cell) std::getline(fields, text, ',');
    if (!cell[column].empty()) points.push_back({line[0], std::stod(cell[1]), std::stod(cell[column])});
  }
  return points;
}

// The cavity's plane is that of `along`, in which the lid moves, and `across`; it may lie any way.
GasSetup cavity_setup(int along = 0, int across = 1, const Convection& convection = Upwind{}) {
  GasSetup setup = still_air();
  setup.convection = convection;
  setup.density = 1;
  setup.viscosity = 0.01;
  Vec3 lid;
  lid[along] = 1;
  setup.faces[along] = {NoSlip{}, NoSlip{}};
  setup.faces[across] = {NoSlip{}, NoSlip{lid}};
  return setup;
}

// Velocity on a centre line, linear between faces' centres and the walls.
double on_centre_line(const GasBox& box, const Point& point, int n) {
  const double at = point.s * n - 0.5;
  const int below = static_cast<int>(std::floor(at));
  const auto value = [&](int i) {
    return point.component == 'u' ? box.state.velocity[0](n / 2, i, 0) : box.state.velocity[1](i, n / 2, 0);
  };
  const double lid = point.component == 'u' ? 1 : 0;
  if (below < 0) return value(0) * 2 * (at + 0.5);
  if (below >= n - 1) return value(n - 1) + (lid - value(n - 1)) * 2 * (at - (n - 1));
  return value(below) + (at - below) * (value(below + 1) - value(below));
}

// Beyond Re 100 by projection, for 50 passages of the lid: the flow is steady to 1e-4 then.
double mean_error(int n, const Convection& convection = Upwind{}, int reynolds = 100) {
  GasSetup setup = cavity_setup(0, 1, convection);
  setup.viscosity = 1.0 / reynolds;
  setup.tolerance = 1e-5;
  if (reynolds > 100) setup.method = GasMethod::projection;
  GasBox box({n, n, 1}, {1, 1, 1.0 / n}, {false, false, false}, setup);
  if (reynolds == 100) {
    EXPECT_TRUE(box.settle(0.2, 1e-6, 400));
  } else {
    for (int step = 0; step < 50 * n; ++step) EXPECT_TRUE(box.step(1.0 / n).converged);
  }
  double sum = 0;
  const std::vector<Point> points = ghia(reynolds);
  for (const Point& point : points) sum += std::abs(on_centre_line(box, point, n) - point.value);
  return sum / static_cast<double>(points.size());
}

TEST(Cavity, UpwindConvergesToGhiaWithFirstOrder) {
  ASSERT_EQ(ghia(100).size(), 34u);
  const double coarse = mean_error(12), middle = mean_error(24), fine = mean_error(48);
  EXPECT_LT(fine, 0.01);                            // of the lid's speed
  EXPECT_NEAR(std::log2(coarse / middle), 1, 0.3);  // upwind's order; 0.3: 12 cells do not resolve the lid's layer
  EXPECT_NEAR(std::log2(middle / fine), 1, 0.3);
}

TEST(Cavity, SecondOrderNeedsHalfTheCellsOfUpwindForLessThanHalfItsError) {
  const double upwind = mean_error(48);
  EXPECT_LT(mean_error(24, Smart{}), upwind / 2);
  EXPECT_LT(mean_error(24, Superbee{}), upwind / 2);
}

TEST(Cavity, SecondOrderFollowsGhiaToReynolds1000) {
  ASSERT_EQ(ghia(400).size(), 33u);
  // Measured: 0.0056 and 0.0146 of the lid's speed; upwind has 0.037 and 0.072 on this grid.
  EXPECT_LT(mean_error(48, Smart{}, 400), 0.007);
  EXPECT_LT(mean_error(48, Smart{}, 1000), 0.018);
}

TEST(Cavity, OneStepOfAnyLengthReachesTheSteadyState) {
  const int n = 16;
  GasSetup setup = cavity_setup();
  setup.tolerance = 1e-6;
  GasBox slow({n, n, 1}, {1, 1, 1.0 / n}, {false, false, false}, setup),
      fast({n, n, 1}, {1, 1, 1.0 / n}, {false, false, false}, setup);
  ASSERT_TRUE(slow.settle(0.2, 1e-7, 400));
  const GasOutcome outcome = fast.step(1e6);
  ASSERT_TRUE(outcome.converged) << outcome.reason;
  fast.for_cells([&](int i, int j, int k) {
    for (int d = 0; d < 2; ++d)
      EXPECT_NEAR(fast.state.velocity[d](i, j, k), slow.state.velocity[d](i, j, k), 2e-5);  // settled to 1e-7 a step
  });
}

// Six ways to lay the cavity; all but the order of sums is the same.
void expect_same_in_all_axes(const Convection& convection) {
  const int n = 10;
  const auto run = [&](int along, int across) {
    GasSetup setup = cavity_setup(along, across, convection);
    setup.tolerance = 1e-10;
    Int3 cells{3, 3, 3};
    cells[along] = cells[across] = n;
    auto box = std::make_unique<GasBox>(cells, Vec3{1, 1, 1}, std::array<bool, 3>{false, false, false}, setup);
    for (int step = 0; step < 3; ++step) EXPECT_TRUE(box->step(0.1).converged);
    return box;
  };
  const auto reference = run(0, 1);
  for (const auto& [along, across] : {std::pair{0, 2}, {1, 0}, {1, 2}, {2, 0}, {2, 1}}) {
    const auto box = run(along, across);
    const int third = 3 - along - across;
    reference->for_cells([&, along = along, across = across](int i, int j, int k) {
      Int3 at{};
      at[along] = i;
      at[across] = j;
      at[third] = k;
      const int to[3] = {along, across, third};
      for (int d = 0; d < 3; ++d)
        ASSERT_NEAR(box->state.velocity[to[d]](at[0], at[1], at[2]), reference->state.velocity[d](i, j, k),
                    1e-8);  // 100 tolerances
    });
  }
}

TEST(Cavity, DoesNotKnowTheAxes) {
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{}), Convection(Superbee{})})
    expect_same_in_all_axes(scheme);
}

}  // namespace
}  // namespace bedflow
