// Flows between parallel plates against their closed forms.
#include <gtest/gtest.h>

#include "gas_box.h"

namespace bedflow {
namespace {

// Between plates at y = 0 and H, driven by gravity.x = g, upper plate at speed w: u = (g/2ν) y (H − y) + w y/H.
struct Plates {
  double height = 0.01, viscosity = 0.01, density = 1.2, gravity = 2, wall = 0;
  double exact(double y) const { return 0.5 * gravity * density / viscosity * y * (height - y) + wall * y / height; }
};

// Largest error over the cells, over the fastest speed of the parabola.
double plate_error(const Plates& plates, int n, int across = 1, int along = 0, GasMethod method = GasMethod::simple) {
  GasSetup setup = still_air();
  setup.method = method;
  setup.viscosity = plates.viscosity;
  setup.gravity[along] = plates.gravity;
  Vec3 wall;
  wall[along] = plates.wall;
  setup.faces[across] = {NoSlip{}, NoSlip{wall}};
  setup.tolerance = 1e-11;
  setup.velocity_relaxation = 0.95;  // the problem is linear
  setup.max_iterations = 20000;
  Int3 cells{2, 2, 2};
  cells[across] = n;
  Vec3 size{0.01, 0.01, 0.01};
  size[across] = plates.height;
  std::array<bool, 3> periodic{true, true, true};
  periodic[across] = false;
  GasBox box(cells, size, periodic, setup);
  const double viscous_time = plates.density * plates.height * plates.height / plates.viscosity;
  // The projection solves its momentum by sweeps: steps of some cells' viscous times.
  const double share = method == GasMethod::simple ? 2 : 1.0 / (n * n);
  EXPECT_TRUE(box.settle(share * viscous_time, method == GasMethod::simple ? 1e-12 : 1e-14, 60 + 20 * n * n));
  double worst = 0, fastest = 0;
  box.for_cells([&](int i, int j, int k) {
    const int at[3] = {i, j, k};
    const double exact = plates.exact(box.centre(across, at[across]));
    worst = std::max(worst, std::abs(box.state.velocity[along](i, j, k) - exact));
    fastest = std::max(fastest, std::abs(exact));
  });
  return worst / fastest;
}

TEST(Poiseuille, PeriodicChannelConvergesToTheParabolaWithOrderTwo) {
  const Plates plates;
  const double coarse = plate_error(plates, 8), middle = plate_error(plates, 16), fine = plate_error(plates, 32);
  EXPECT_NEAR(std::log2(coarse / middle), 2, 0.05);  // the scheme's order; 0.05: the fastest cell is not the axis itself
  EXPECT_NEAR(std::log2(middle / fine), 2, 0.05);
  EXPECT_LT(fine, 1e-3);  // 1/32² is 0.98e-3: the parabola's own scale
}

TEST(Poiseuille, ByProjectionIsTheSameParabola) {
  const Plates plates{.wall = 0.01};
  for (const int n : {8, 16}) {
    const double simple = plate_error(plates, n), projection = plate_error(plates, n, 1, 0, GasMethod::projection);
    EXPECT_NEAR(projection, simple, 1e-8) << n;  // what steps that change by 1e-14 have still before them
  }
}

TEST(Couette, WithPressureGradientOfBothSignsConvergesWithOrderTwo) {
  for (const double gravity : {2.0, -2.0}) {
    const Plates plates{.gravity = gravity, .wall = 0.01};
    const double coarse = plate_error(plates, 8), fine = plate_error(plates, 16);
    EXPECT_NEAR(std::log2(coarse / fine), 2, 0.15) << gravity;  // 0.15: the fastest cell wanders with the grid
  }
}

// The straight line has no third derivative: nothing is left to be wrong.
TEST(Couette, WithoutPressureGradientIsExact) {
  EXPECT_LT(plate_error({.gravity = 0, .wall = 0.01}, 8), 1e-9);  // tolerance 1e-11 of the forces times n²
}

TEST(Poiseuille, DoesNotKnowTheAxes) {
  const Plates plates{.wall = 0.01};
  const double reference = plate_error(plates, 8, 1, 0);
  for (int across = 0; across < 3; ++across)
    for (int along = 0; along < 3; ++along)
      if (across != along) {
        EXPECT_NEAR(plate_error(plates, 8, across, along), reference, 1e-9) << across << along;  // tolerance times n²
      }
}

TEST(Poiseuille, BetweenInflowAndOutflowTheProfileDevelopsIntoTheParabola) {
  const double height = 0.01, length = 0.04, mean = 0.1, viscosity = 1.2e-3;  // Re 1: developed after a height
  const auto run = [&](int n) {
    GasSetup setup = still_air();
    setup.viscosity = viscosity;
    setup.faces[0] = {Inflow{{mean, 0, 0}, {}}, Outflow{5}};
    setup.faces[1] = {NoSlip{}, NoSlip{}};
    setup.tolerance = 1e-8;
    GasBox box({2 * n, n, 1}, {length, height, 0.01}, {false, false, true}, setup);
    EXPECT_TRUE(box.settle(0.1, 1e-8, 60));
    double worst = 0;
    for (int j = 0; j < n; ++j) {
      const double y = box.centre(1, j) / height;
      worst = std::max(worst, std::abs(box.state.velocity[0](3 * n / 2, j, 0) / mean - 6 * y * (1 - y)));
      EXPECT_NEAR(box.state.velocity[0](2 * n, j, 0), box.state.velocity[0](3 * n / 2, j, 0), 2e-3 * mean);  // developed
    }
    const double drop = (box.state.pressure(n, 0, 0) - box.state.pressure(3 * n / 2, 0, 0)) / (0.25 * length);
    EXPECT_NEAR(drop / (12 * viscosity * mean / (height * height)), 1, 3.0 / (n * n));  // second order
    return worst;
  };
  const double coarse = run(8), fine = run(16);
  EXPECT_LT(fine, 0.01);
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.1);  // second order, with a trace of upwind
}

// One direction, no inertia: the normal stress 2μ u' − (2/3)μ u' balances the pressure, p − (4/3)μ u' is the same in all cells.
TEST(Viscosity, NormalStressOfADilatingFlowIsFourThirds) {
  GasSetup setup = still_air();
  setup.density = 1e-9;
  setup.viscosity = 1;
  setup.faces[0] = {Inflow{{0.5, 0, 0}, {}}, Outflow{0}};
  setup.tolerance = 1e-10;
  GasBox box({24, 2, 2}, {0.24, 0.02, 0.02}, {false, true, true}, setup);
  box.for_cells([&](int i, int j, int k) { box.state.fraction(i, j, k) = 0.7 + 0.2 * std::sin(30 * box.centre(0, i)); });
  ASSERT_TRUE(box.step(1).converged);
  const auto stress = [&](int i) {
    return 4.0 / 3 * (box.state.velocity[0](i + 1, 0, 0) - box.state.velocity[0](i, 0, 0)) / 0.01;
  };
  for (int i = 1; i < 24; ++i)
    EXPECT_NEAR(box.state.pressure(i, 0, 0) - stress(i), box.state.pressure(0, 0, 0) - stress(0), 1e-5) << i;  // of 30: tolerance
}

}  // namespace
}  // namespace bedflow
