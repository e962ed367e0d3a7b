// The projection beside SIMPLE: the same steady states, the same course as the step goes to 0, and any drag.
#include <gtest/gtest.h>

#include "gas_box.h"

namespace bedflow {
namespace {

GasSetup tight(GasSetup setup, GasMethod method) {
  setup.method = method;
  setup.tolerance = 1e-8;
  setup.pressure_tolerance = method == GasMethod::projection ? 1e-10 : 1e-2;
  return setup;
}

// A bed of uneven ε and drag below clear gas, in a channel with walls. Particles sway at `speed`.
void load_bed(GasBox& box, double drag, double speed) {
  const double height = box.grid.spacing.y * box.grid.global[1];
  const auto epsilon = [=](double x, double y) {
    return y > 0.55 * height ? 1.0 : 0.5 + 0.1 * std::sin(300 * x) * std::cos(200 * y);
  };
  set_fraction(box, [&](double x, double y, double) { return epsilon(x, y); });
  for (int d = 0; d < 3; ++d)
    for_solved(box, d, [&, d](int i, int j, int k) {
      const double x = box.grid.low.x + box.grid.spacing.x * (i + (d == 0 ? 0 : 0.5));
      const double y = box.grid.low.y + box.grid.spacing.y * (j + (d == 1 ? 0 : 0.5));
      const double solids = 1 - epsilon(x, y);
      box.exchange.drag[d](i, j, k) = drag * solids * box.grid.cell_volume();
      box.exchange.drag_momentum[d](i, j, k) = box.exchange.drag[d](i, j, k) * (d == 0 ? speed * std::sin(100 * y) : 0);
      box.exchange.buoyancy[d](i, j, k) = solids;
    });
}

struct Difference {
  double velocity = 0, pressure = 0;  // largest, over the largest
};
Difference difference(const GasBox& a, const GasBox& b) {
  double fastest = 0, highest = 0;
  Difference worst;
  for (int d = 0; d < 3; ++d)
    for_solved(a, d, [&, d](int i, int j, int k) {
      fastest = std::max(fastest, std::abs(a.state.velocity[d](i, j, k)));
      worst.velocity = std::max(worst.velocity, std::abs(a.state.velocity[d](i, j, k) - b.state.velocity[d](i, j, k)));
    });
  a.for_cells([&](int i, int j, int k) {
    highest = std::max(highest, std::abs(a.state.pressure(i, j, k)));
    worst.pressure = std::max(worst.pressure, std::abs(a.state.pressure(i, j, k) - b.state.pressure(i, j, k)));
  });
  return {worst.velocity / fastest, worst.pressure / highest};
}

constexpr Int3 cells{10, 24, 3};
constexpr Vec3 size{0.05, 0.12, 0.015};

TEST(Projection, SteadyStatesAreThoseOfSimple) {
  for (const Convection& scheme : {Convection{Upwind{}}, Convection{Smart{}}})
    for (const double drag : {0.0, 1e3, 1e6}) {
      GasSetup setup = upright(0.5);
      setup.convection = scheme;
      setup.viscosity = 1e-3;
      GasBox simple(cells, size, {false, false, false}, tight(setup, GasMethod::simple), Comm::self(), 1);
      GasBox projection(cells, size, {false, false, false}, tight(setup, GasMethod::projection), Comm::self(), 1);
      for (GasBox* box : {&simple, &projection}) {
        load_bed(*box, drag, 0.2);
        ASSERT_TRUE(box->settle(2e-3, 1e-9, 1500, true)) << drag;
      }
      const Difference found = difference(simple, projection);
      EXPECT_LT(found.velocity, 1e-5) << drag;  // tolerance 1e-8 of all forces, a thousand of which pass a face's own
      EXPECT_LT(found.pressure, 1e-5) << drag;
    }
}

// Both are backward Euler of first order; what they take from the step's start or its end differs by the order of a step.
TEST(Projection, TakesTheCourseOfSimpleAsTheStepGoesToZero) {
  for (const double drag : {0.0, 500.0}) {
    std::array<Difference, 3> found;
    for (int level = 0; level < 3; ++level) {
      GasSetup setup = upright(0.5);
      setup.viscosity = 1e-3;
      std::get<Inflow>(setup.faces[1][0]).jet.ramp = 0.02;  // from rest
      GasBox simple(cells, size, {false, false, false}, tight(setup, GasMethod::simple), Comm::self(), 1);
      GasBox projection(cells, size, {false, false, false}, tight(setup, GasMethod::projection), Comm::self(), 1);
      for (GasBox* box : {&simple, &projection}) {
        load_bed(*box, drag, 0.5);
        const int steps = 10 << level;
        for (int n = 0; n < steps; ++n) ASSERT_TRUE(box->step(0.02 / steps, true).converged);
      }
      found[level] = difference(simple, projection);
    }
    for (int level = 1; level < 3; ++level) {
      EXPECT_GT(std::log2(found[level - 1].velocity / found[level].velocity), 0.85) << drag;  // first order, from below
      EXPECT_GT(std::log2(found[level - 1].pressure / found[level].pressure), 0.85) << drag;
    }
    EXPECT_LT(found[2].velocity, 0.01) << drag;
  }
}

// Bed and clear gas of up to a million times apart; steps up to a hundred times what carries gas through a cell in the bed.
TEST(Projection, TakesAnyDrag) {
  const double dt = 1e-4;
  for (const double ratio : {0.0, 1.0, 1e3, 1e6}) {
    GasSetup setup = tight(upright(0.5), GasMethod::projection);
    setup.preconditioner = Preconditioner::multigrid;
    GasBox box({9, 24, 4}, {0.045, 0.12, 0.02}, {false, false, false}, setup, Comm::self(), 1);
    fill_lower_half(box, ratio * setup.density * 0.45 / dt);
    for (int n = 0; n < 20; ++n) {
      const GasOutcome outcome = box.step(dt, true);
      ASSERT_TRUE(outcome.converged) << ratio << ": " << outcome.reason;
      EXPECT_LE(outcome.pressure_iterations, 20) << ratio;  // to 1e-10
      double fastest = 0, sum = 0;
      for_solved(box, 1, [&](int i, int j, int k) { fastest = std::max(fastest, std::abs(box.state.velocity[1](i, j, k))); });
      box.for_cells([&](int i, int j, int k) { sum += std::abs(box.imbalance(i, j, k)); });
      EXPECT_LT(fastest, 0.5 / 0.45 * 1.3) << ratio;  // U/ε, and what walls squeeze into the middle
      EXPECT_LT(sum, 1e-8 * 3 * 0.5 * 0.045 * 0.02) << ratio << " step " << n;
    }
  }
}

// What the gas loses between the steps is what the drag and the rest of its forces of the step's END take: momentum closes.
TEST(Projection, MomentumOfTheGasClosesWithTheVelocityOfTheEnd) {
  GasSetup setup = tight(still_air(), GasMethod::projection);
  setup.gravity = {0, -9.81, 0};
  GasBox box({8, 8, 8}, {0.04, 0.04, 0.04}, {true, true, true}, setup);
  const double epsilon = 0.6, drag = 300, dt = 1e-3;
  set_fraction(box, [=](double, double, double) { return epsilon; });
  fill_exchange(box, drag, 0.4, {0.3, -0.2, 0.1});
  box.for_cells([&](int i, int j, int k) {  // particles that differ from cell to cell
    for (int d = 0; d < 3; ++d) {
      box.exchange.drag[d](i, j, k) *= 1 + 0.5 * std::sin(0.8 * i + 0.5 * j * d + k);
      box.exchange.drag_momentum[d](i, j, k) *= 1 + 0.5 * std::cos(0.8 * i + j);
    }
  });
  const auto momentum = [&](int d) {
    double sum = 0;
    box.for_cells(
        [&](int i, int j, int k) { sum += setup.density * epsilon * box.grid.cell_volume() * box.state.velocity[d](i, j, k); });
    return sum;
  };
  for (int n = 0; n < 3; ++n) {
    const std::array<double, 3> before{momentum(0), momentum(1), momentum(2)};
    ASSERT_TRUE(box.step(dt, true).converged);
    for (int d = 0; d < 3; ++d) {
      double force = 0, size_of_it = 0;
      box.for_cells([&](int i, int j, int k) {
        const double given =
            box.exchange.drag_momentum[d](i, j, k) - box.exchange.drag[d](i, j, k) * box.state.velocity[d](i, j, k);
        force += given + epsilon * setup.density * setup.gravity[d] * box.grid.cell_volume();
        size_of_it += std::abs(given);
      });
      // Upwind convection of the non-conservative form keeps momentum where ∇·(εU) = 0: to the solvers' tolerance.
      EXPECT_NEAR((momentum(d) - before[d]) / dt, force, 2e-3 * size_of_it) << d;
    }
  }
}

TEST(Projection, StepThatCarriesGasTooFarIsRefusedByName) {
  GasSetup setup = tight(upright(0.5), GasMethod::projection);
  setup.viscosity = 10;
  GasBox box(cells, size, {false, false, false}, setup, Comm::self(), 1);
  const GasState before = box.state;
  const GasOutcome outcome = box.step(10);
  EXPECT_FALSE(outcome.converged);
  EXPECT_NE(outcome.reason.find("carried too far"), std::string::npos) << outcome.reason;
  EXPECT_EQ(box.state.velocity[1](3, 3, 1), before.velocity[1](3, 3, 1));
}

}  // namespace
}  // namespace bedflow
