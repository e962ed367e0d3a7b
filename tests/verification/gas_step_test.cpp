// One step as a promise: residuals without units or grid, the same bits after a restart, and no step on fields that did not
// converge.
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "gas_box.h"

namespace bedflow {
namespace {

// Powers of two scale every number without rounding: the same iterations and the same bits of the residuals.
TEST(GasResidual, DoesNotDependOnUnits) {
  const auto run = [](double length, double second, double mass) {
    GasSetup setup = upright(0.5 * length / second);
    setup.density *= mass / (length * length * length);
    setup.viscosity *= mass / (length * second);
    setup.gravity *= length / (second * second);
    GasBox box({6, 10, 3}, {0.03 * length, 0.05 * length, 0.015 * length}, {false, false, false}, setup);
    set_fraction(box,
                 [=](double x, double y, double) { return 0.6 + 0.3 * std::sin(200 * x / length) * std::cos(150 * y / length); });
    fill_exchange(box, 500 * mass / (length * length * length) / second, 0.3, {0, 0.1 * length / second, 0});
    return box.step(1e-3 * second, true);
  };
  const GasOutcome si = run(1, 1, 1), other = run(1024, 16, 8);
  ASSERT_TRUE(si.converged);
  EXPECT_EQ(si.iterations, other.iterations);
  EXPECT_EQ(si.pressure_iterations, other.pressure_iterations);
  EXPECT_EQ(si.momentum_residual, other.momentum_residual);
  EXPECT_EQ(si.continuity_residual, other.continuity_residual);
}

// The imbalance of one smooth field that is not a solution, on two grids.
TEST(GasResidual, DoesNotDependOnTheGrid) {
  const auto residual = [](int n, double viscosity) {
    GasSetup setup = still_air();
    setup.density = 1;
    setup.viscosity = viscosity;
    setup.min_iterations = setup.max_iterations = 0;
    GasBox box({n, n, n}, {1, 1, 1}, {true, true, true}, setup);
    const double wave = 2 * std::numbers::pi;
    box.for_cells([&](int i, int j, int k) {
      box.state.velocity[0](i, j, k) = 1 + 0.5 * std::sin(wave * i / n) * std::cos(wave * box.centre(1, j));
      box.state.velocity[1](i, j, k) = 0.5 * std::cos(wave * box.centre(0, i)) * std::sin(wave * j / n);
      box.state.pressure(i, j, k) = 0.1 * std::sin(wave * box.centre(2, k));
    });
    return box.step(1).momentum_residual;
  };
  for (const double viscosity : {1e-6, 0.01, 1.0}) {
    const double coarse = residual(16, viscosity), fine = residual(64, viscosity);
    EXPECT_GT(coarse, 0.1) << viscosity;
    EXPECT_NEAR(fine / coarse, 1, 0.1) << viscosity;  // 10 %: what 16 cells a wave leave to the differences
  }
}

// What a checkpoint holds is enough: cells, owned faces and the last faces of the box. Whatever the ghosts held before.
TEST(GasRestart, GoesOnWithTheSameBits) {
  const GasSetup setup = upright(0.5);
  GasBox through({6, 10, 3}, {0.03, 0.05, 0.015}, {false, false, true}, setup);
  set_fraction(through, [](double x, double y, double) { return 0.6 + 0.3 * std::sin(200 * x) * std::cos(150 * y); });
  fill_exchange(through, 500, 0.3);
  for (int n = 0; n < 3; ++n) ASSERT_TRUE(through.step(1e-3, true).converged);
  GasBox resumed({6, 10, 3}, {0.03, 0.05, 0.015}, {false, false, true}, setup);
  GasState& state = resumed.state;
  for (Field* field : {&state.velocity[0], &state.velocity[1], &state.velocity[2], &state.pressure, &state.fraction})
    field->fill(7);
  resumed.exchange = through.exchange;
  through.for_cells([&](int i, int j, int k) {
    state.pressure(i, j, k) = through.state.pressure(i, j, k);
    state.fraction(i, j, k) = through.state.fraction(i, j, k);
    for (int d = 0; d < 3; ++d) {
      state.velocity[d](i, j, k) = through.state.velocity[d](i, j, k);
      const Int3 next{i + (d == 0), j + (d == 1), k + (d == 2)};
      if (next[d] == through.grid.cells[d])
        state.velocity[d](next[0], next[1], next[2]) = through.state.velocity[d](next[0], next[1], next[2]);
    }
  });
  resumed.time = through.time;
  resumed.solver.prepare(state, resumed.time);
  for (int n = 0; n < 2; ++n) {
    ASSERT_TRUE(through.step(1e-3, true).converged);
    ASSERT_TRUE(resumed.step(1e-3, true).converged);
  }
  for (int d = 0; d < 3; ++d)
    for_solved(through, d,
               [&](int i, int j, int k) { ASSERT_EQ(state.velocity[d](i, j, k), through.state.velocity[d](i, j, k)); });
  through.for_cells([&](int i, int j, int k) { ASSERT_EQ(state.pressure(i, j, k), through.state.pressure(i, j, k)); });
  EXPECT_EQ(resumed.solver.balance().out, through.solver.balance().out);
}

// State, to the bit, and a reason that names what is wrong.
void expect_refused(GasBox& box, double dt, const std::string& word) {
  const GasState before = box.state;
  const GasOutcome outcome = box.step(dt, true);
  EXPECT_FALSE(outcome.converged);
  EXPECT_NE(outcome.reason.find(word), std::string::npos) << outcome.reason;
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  for (std::size_t i = 0; i < box.grid.size(); ++i) {
    for (int d = 0; d < 3; ++d) ASSERT_TRUE(same(box.state.velocity[d].data()[i], before.velocity[d].data()[i]));
    ASSERT_TRUE(same(box.state.pressure.data()[i], before.pressure.data()[i]));
  }
}

TEST(NotConverged, TooFewIterationsRestoreTheStateAndSaySo) {
  GasSetup setup = upright(0.5);
  setup.tolerance = 1e-9;
  setup.max_iterations = 3;
  GasBox box({6, 8, 4}, {0.03, 0.04, 0.02}, {false, false, false}, setup);
  expect_refused(box, 1e-3, "3 outer iterations");
}

TEST(NotConverged, FieldsThatAreNotFiniteRestoreTheStateAndSaySo) {
  GasBox box({6, 8, 4}, {0.03, 0.04, 0.02}, {false, false, false}, upright(0.5));
  ASSERT_TRUE(box.step(1e-3).converged);
  box.exchange.drag[1](2, 3, 1) = std::numeric_limits<double>::quiet_NaN();
  expect_refused(box, 1e-3, "not finite");
  box.exchange.drag[1](2, 3, 1) = 0;
  EXPECT_TRUE(box.step(1e-3, true).converged);  // nothing of it is left behind
  box.state.velocity[0](2, 3, 1) = std::numeric_limits<double>::infinity();
  expect_refused(box, 1e-3, "not finite");
}

TEST(NotConverged, ClosedBoxThatCannotBalanceIsNamed) {
  GasSetup setup = still_air();
  setup.faces[1][0] = Inflow{{0.5, 0, 0}, {}};
  GasBox fed({4, 4, 4}, {0.04, 0.04, 0.04}, {false, false, false}, setup);
  expect_refused(fed, 1e-3, "no outflow and cannot balance");
  GasBox grown({4, 4, 4}, {0.04, 0.04, 0.04}, {true, true, true}, still_air());
  grown.state.fraction_rate(1, 1, 1) = 1;
  expect_refused(grown, 1e-3, "d eps/dt");
  grown.state.fraction_rate(2, 1, 1) = -1;
  EXPECT_TRUE(grown.step(1e-3).converged);
}

TEST(NotConverged, BuoyancyThatLeavesNoPressureForceIsNamed) {
  GasBox box({4, 4, 4}, {0.04, 0.04, 0.04}, {true, true, true}, still_air());
  box.exchange.buoyancy[2](1, 1, 1) = 1;
  expect_refused(box, 1e-3, "buoyancy");
}

}  // namespace
}  // namespace bedflow
