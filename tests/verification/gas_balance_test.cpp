// Mass in every cell, displacement by moving solids, drag, weight, and what crosses the faces of the box.
#include <gtest/gtest.h>

#include <numbers>

#include "gas_box.h"

namespace bedflow {
namespace {

using GasMass = EitherMethod;
using Displacement = EitherMethod;
using Drag = EitherMethod;
using GasInflow = EitherMethod;
using GasOutflow = EitherMethod;
using Hydrostatics = EitherMethod;
INSTANTIATE_TEST_SUITE_P(By, GasMass, either_method, method_name);
INSTANTIATE_TEST_SUITE_P(By, Displacement, either_method, method_name);
INSTANTIATE_TEST_SUITE_P(By, Drag, either_method, method_name);
INSTANTIATE_TEST_SUITE_P(By, GasInflow, either_method, method_name);
INSTANTIATE_TEST_SUITE_P(By, GasOutflow, either_method, method_name);
INSTANTIATE_TEST_SUITE_P(By, Hydrostatics, either_method, method_name);

TEST_P(GasMass, IsConservedInEveryCellToTheTolerance) {
  GasSetup setup = upright(0.5);
  setup.tolerance = 1e-6;
  GasBox box({10, 24, 4}, {0.05, 0.12, 0.02}, {false, false, false}, by_method(setup), Comm::self(), 1);
  set_fraction(
      box, [](double x, double y, double z) { return 0.7 + 0.25 * std::sin(200 * x) * std::cos(150 * y) * std::sin(90 * z); });
  box.for_cells([&](int i, int j, int k) { box.state.fraction_rate(i, j, k) = std::sin(0.7 * i + j) * std::cos(0.3 * k); });
  fill_exchange(box, 500, 0.3);
  for (int n = 0; n < 5; ++n) ASSERT_TRUE(box.step(1e-4, true).converged);
  const double throughput = 0.5 * 0.05 * 0.02;
  double sum = 0;
  box.for_cells([&](int i, int j, int k) { sum += std::abs(box.imbalance(i, j, k)); });
  EXPECT_LT(sum, 3 * setup.tolerance * throughput);  // 3: the solver's throughput counts three directions and storage
  const GasBalance balance = box.solver.balance();
  EXPECT_NEAR(balance.in, throughput, 1e-12 * throughput);  // given, to round-off
  EXPECT_NEAR(balance.in, balance.out + balance.storage, 3 * setup.tolerance * throughput);
}

// ∂ε/∂t the same everywhere: over a floor the superficial velocity at height y is −y ∂ε/∂t.
TEST_P(Displacement, UniformRateInAnOpenBoxGivesTheVelocityOfTheVolumeBalance) {
  GasSetup setup = still_air();
  setup.faces[1][1] = Outflow{0};
  setup.tolerance = 1e-9;
  GasBox box({3, 16, 2}, {0.03, 0.16, 0.02}, {false, false, true}, by_method(setup));
  const double rate = -2, epsilon = 0.5;
  set_fraction(box, [=](double, double, double) { return epsilon; });
  box.for_cells([&](int i, int j, int k) { box.state.fraction_rate(i, j, k) = rate; });
  for (int n = 0; n < 3; ++n) ASSERT_TRUE(box.step(1e-3).converged);
  for_solved(box, 1, [&](int i, int j, int k) {
    EXPECT_NEAR(epsilon * box.state.velocity[1](i, j, k), -rate * 0.01 * j, 1e-9 * 0.32);  // tolerance times the highest
  });
}

// A frozen cloud that swings to and fro in a closed box pushes the gas the other way: ε u = −∫ ∂ε/∂t dx.
TEST_P(Displacement, SwingingCloudInAClosedBoxMovesTheGasByTheVolumeBalance) {
  GasSetup setup = still_air();
  setup.tolerance = 1e-9;
  const int n = 32;
  const double length = 0.32, dt = 1e-3, amplitude = 0.02, pi = std::numbers::pi;
  GasBox box({n, 2, 2}, {length, 0.02, 0.02}, {false, true, true}, by_method(setup));
  // Gas left of x: the cloud is one wave of ε that slides.
  const auto volume = [&](double x, double t) {
    const double shift = amplitude * std::sin(20 * t);
    return 0.7 * x + 0.2 * length / (2 * pi) * std::sin(2 * pi * x / length) * (1 + shift / length * 10);
  };
  for (int step = 0; step < 10; ++step) {
    const auto mean = [&](int i, double t) { return (volume((i + 1) * 0.01, t) - volume(i * 0.01, t)) / 0.01; };
    const double now = box.time + dt;
    box.for_cells([&](int i, int j, int k) {
      box.state.fraction(i, j, k) = mean(i, now);
      box.state.fraction_rate(i, j, k) = (mean(i, now) - mean(i, now - dt)) / dt;
    });
    const GasOutcome outcome = box.step(dt);
    ASSERT_TRUE(outcome.converged) << outcome.reason;
    double fastest = 0;
    for (int i = 1; i < n; ++i) fastest = std::max(fastest, std::abs(volume(i * 0.01, now) - volume(i * 0.01, now - dt)) / dt);
    for (int i = 1; i < n; ++i) {
      const double epsilon = 0.5 * (box.state.fraction(i - 1, 0, 0) + box.state.fraction(i, 0, 0));
      const double exact = -(volume(i * 0.01, now) - volume(i * 0.01, now - dt)) / dt;
      EXPECT_NEAR(epsilon * box.state.velocity[0](i, 0, 0), exact, 1e-7 * fastest);  // tolerance summed over the cells
    }
  }
}

TEST_P(Drag, FixedBedInAChannelHasThePressureDropOfTheClosedForm) {
  // ε_b A Δp = Σ b u over a control volume, ε_b = ε: Δp/h = (drag density) u / ε, u = U/ε.
  const double superficial = 0.5, epsilon = 0.4, drag = 3000;
  GasSetup setup = upright(superficial);
  setup.faces[0] = {FreeSlip{}, FreeSlip{}};
  setup.tolerance = 1e-9;
  GasBox box({4, 20, 2}, {0.02, 0.1, 0.01}, {false, false, false}, by_method(setup));
  set_fraction(box, [=](double, double, double) { return epsilon; });
  fill_exchange(box, drag, 1 - epsilon);
  for (int n = 0; n < 60; ++n) ASSERT_TRUE(box.step(1e-3, true).converged);  // the pressure is the last to settle
  const double gradient = drag * superficial / epsilon / epsilon + setup.density * 9.81;
  for (int j = 1; j < 20; ++j) {
    const double drop = box.state.pressure(1, j - 1, 0) - box.state.pressure(1, j, 0);
    EXPECT_NEAR(drop / (gradient * 0.005), 1, 1e-7);  // exact for a uniform bed, up to the tolerance
  }
  EXPECT_NEAR(box.state.pressure(1, 19, 0) / (gradient * 0.0025), 1, 1e-7);  // half a cell below the outflow
}

TEST(DragBySimple, UpToAMillionTimesInertiaConvergesInFewIterations) {
  const double dt = 1e-4;
  for (const double ratio : {0.0, 1.0, 1e3, 1e6}) {
    GasSetup setup = upright(0.5);
    GasBox box({9, 24, 4}, {0.045, 0.12, 0.02}, {false, false, false}, setup, Comm::self(), 1);
    // Solids below 60 mm only: the coefficients jump by `ratio`.
    fill_exchange(box, 0, 0);
    fill_lower_half(box, ratio * setup.density * 0.45 / dt);
    for (int n = 0; n < 4; ++n) {
      const GasOutcome outcome = box.step(dt, true);
      ASSERT_TRUE(outcome.converged) << ratio << ": " << outcome.reason;
      // Each iteration leaves 1/5 of the pressure's error; the impulsive start's own pressure (ρ L U/Δt, 500 times the rest)
      // comes in the first step and goes in the second.
      EXPECT_LE(outcome.iterations, n < 2 ? 10 : 4) << ratio << " step " << n;
    }
  }
}

TEST_P(Drag, GasFollowsParticlesThatDragIt) {
  // Periodic box, particles moving at V: u = V (1 − (1 + β dt/ρε)^−n), the implicit scheme's own exact answer.
  GasSetup setup = still_air();
  setup.tolerance = 1e-12;
  GasBox box({4, 4, 4}, {0.04, 0.04, 0.04}, {true, true, true}, by_method(setup));
  const double epsilon = 0.6, drag = 50, dt = 1e-3;
  set_fraction(box, [=](double, double, double) { return epsilon; });
  fill_exchange(box, drag, 1 - epsilon, {0.3, -0.2, 0.1});
  for (int n = 1; n <= 5; ++n) {
    ASSERT_TRUE(box.step(dt, true).converged);
    const double share = 1 - std::pow(1 + drag * dt / (setup.density * epsilon), -n);
    EXPECT_NEAR(box.state.velocity[0](1, 2, 3), 0.3 * share, 1e-11);  // tolerance
    EXPECT_NEAR(box.state.velocity[1](1, 2, 3), -0.2 * share, 1e-11);
    EXPECT_NEAR(box.state.velocity[2](1, 2, 3), 0.1 * share, 1e-11);
  }
}

TEST_P(GasInflow, PatchAcrossCellsBringsExactlyItsFlow) {
  GasSetup setup = upright(0.2);
  const Inflow::Patch patch{{0.0131, 0, 0.0043}, {0.0277, 0, 0.0159}, {5, 1, 0.5}};
  std::get<Inflow>(setup.faces[1][0]).patches = {patch};
  GasBox box({10, 12, 4}, {0.05, 0.06, 0.02}, {false, false, false}, by_method(setup));
  set_fraction(box, [](double x, double, double) { return 0.5 + 5 * x; });
  ASSERT_TRUE(box.step(1e-4).converged);
  const double area = (0.0277 - 0.0131) * (0.0159 - 0.0043), jet = 1 + 4 * 1e-4 / 0.5;  // the ramp at the step's end
  const double exact = 0.2 * (0.05 * 0.02 - area) + jet * area;
  EXPECT_NEAR(box.solver.balance().in / exact, 1, 1e-13);  // round-off
}

// A spout of 60 m/s that starts at once draws gas back in through the outflow beside it.
TEST_P(GasOutflow, GasThatComesBackDoesNotRunAway) {
  GasSetup setup = upright(0);
  std::get<Inflow>(setup.faces[1][0]).patches = {{{0.066, 0, 0.036}, {0.088, 0, 0.048}, {60, 0, 0}}};
  GasBox box({14, 20, 7}, {0.154, 0.08, 0.084}, {false, false, false}, by_method(setup), Comm::self(), 1);
  bool came_back = false;
  const int steps = GetParam() == GasMethod::simple ? 60 : 240;  // Courant number 5.5 and 1.4
  for (int n = 0; n < steps; ++n) {
    const GasOutcome outcome = box.step(0.06 / steps);
    ASSERT_TRUE(outcome.converged) << n << ": " << outcome.reason;
    double fastest = 0;
    for (int d = 0; d < 3; ++d)
      for_solved(box, d, [&](int i, int j, int k) { fastest = std::max(fastest, std::abs(box.state.velocity[d](i, j, k))); });
    EXPECT_LT(fastest, 60 * 1.05);  // nothing pushes but the spout; the step's impulsive start a little
    const GasBalance balance = box.solver.balance();
    EXPECT_NEAR(balance.in, balance.out, 3e-3 * balance.in);  // tolerance, counted over three directions
    came_back = came_back || balance.in > 1.1 * 60 * 0.022 * 0.012;
  }
  EXPECT_TRUE(came_back);
}

// Boxes one cell deep in two directions are pipes; one cell alone is the shortest.
TEST_P(GasMass, IsConservedInBoxesOneCellDeep) {
  for (const int pipe : {0, 1, 2})
    for (const int length : {1, 8}) {
      GasSetup setup = still_air();
      for (auto& faces : setup.faces) faces = {NoSlip{}, NoSlip{}};
      setup.faces[pipe] = {Inflow{{0.5, 0, 0}, {}}, Outflow{0}};
      Int3 cells{1, 1, 1};
      cells[pipe] = length;
      Vec3 size{0.01, 0.01, 0.01};
      size[pipe] *= length;
      GasBox box(cells, size, {false, false, false}, by_method(setup));
      const GasOutcome outcome = box.step(1e-3);
      ASSERT_TRUE(outcome.converged) << outcome.reason;
      for_solved(box, pipe,
                 [&](int i, int j, int k) { EXPECT_NEAR(box.state.velocity[pipe](i, j, k), 0.5, 1e-3); });  // tolerance
    }
}

TEST_P(Hydrostatics, ClosedBoxAtRestCarriesTheWeightOfTheGas) {
  GasSetup setup = still_air();
  setup.gravity = {0, -9.81, 0};
  setup.tolerance = 1e-8;
  GasBox box({3, 8, 3}, {0.03, 0.08, 0.03}, {false, false, false}, by_method(setup));
  for (int n = 0; n < 3; ++n) {
    const GasOutcome outcome = box.step(1e-3);
    ASSERT_TRUE(outcome.converged) << outcome.reason;
  }
  const double drop = box.state.pressure(1, 0, 1) - box.state.pressure(1, 7, 1);
  EXPECT_NEAR(drop / (1.2 * 9.81 * 0.07), 1, 1e-7);  // tolerance
  EXPECT_LT(std::abs(box.state.velocity[1](1, 4, 1)), 1e-8 * 9.81e-3);
}

}  // namespace
}  // namespace bedflow
