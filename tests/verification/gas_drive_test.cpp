// Periodic flows driven by a pressure drop or held at a mass flux, and inflows by mass, in time.
#include <gtest/gtest.h>

#include <numbers>

#include "gas_box.h"

namespace bedflow {
namespace {

// Between plates at y = 0 and H: mean speed of a parabola ū = G H²/(12 μ).
constexpr double height = 0.01, viscosity = 0.01;

GasSetup channel(int along, const Drive& drive) {
  GasSetup setup = still_air();
  setup.viscosity = viscosity;
  setup.faces[(along + 1) % 3] = {NoSlip{}, NoSlip{}};
  setup.drive[along] = drive;
  setup.velocity_relaxation = 0.9;  // the problem is linear
  setup.max_iterations = 5000;
  setup.tolerance = 1e-10;
  return setup;
}

std::unique_ptr<GasBox> developed(int along, int n, const Drive& drive) {
  Int3 cells{3, 3, 3};
  cells[(along + 1) % 3] = n;
  std::array<bool, 3> periodic{true, true, true};
  periodic[(along + 1) % 3] = false;
  auto box = std::make_unique<GasBox>(cells, Vec3{height, height, height}, periodic, channel(along, drive));
  EXPECT_TRUE(box->settle(0.02, 1e-10, 200));  // s; the viscous time H²ρ/μ is 0.012
  return box;
}

double mean_flux(const GasBox& box, int d) {
  double sum = 0;
  box.for_cells([&](int i, int j, int k) {
    const double epsilon = 0.5 * (box.state.fraction(i - (d == 0), j - (d == 1), k - (d == 2)) + box.state.fraction(i, j, k));
    sum += epsilon * box.state.velocity[d](i, j, k);
  });
  return 1.2 * sum / static_cast<double>(box.grid.interior());
}

TEST(Drive, PressureDropGivesPoiseuillesFlux) {
  for (int along = 0; along < 3; ++along) {
    const double drop = 3, exact = 1.2 * drop / height * height * height / (12 * viscosity);
    const double coarse = mean_flux(*developed(along, 8, {.pressure_drop = drop, .mass_flux = {}}), along) / exact - 1;
    const double fine = mean_flux(*developed(along, 16, {.pressure_drop = drop, .mass_flux = {}}), along) / exact - 1;
    EXPECT_NEAR(fine, 2.0 / (16 * 16), 1e-6);        // that of the differences: 2/n²
    EXPECT_NEAR(std::log2(coarse / fine), 2, 0.05);  // the scheme's order
  }
}

TEST(Drive, MassFluxFindsPoiseuillesPressureDrop) {
  for (int along = 0; along < 3; ++along) {
    const double flux = 0.3, exact = 12 * viscosity * flux / 1.2 / (height * height);
    const auto box = developed(along, 16, {.pressure_drop = {}, .mass_flux = flux});
    EXPECT_NEAR(mean_flux(*box, along), flux, 1e-14);
    EXPECT_NEAR(box->state.fall[along] / exact, 1 / (1 + 2.0 / (16 * 16)), 1e-6);  // the differences' own parabola
    const auto back = developed(along, 16, {.pressure_drop = box->state.fall[along] * height, .mass_flux = {}});
    EXPECT_NEAR(mean_flux(*back, along) / flux, 1, 1e-8);  // the two are each other's inverse, to the tolerance
  }
}

// A bed with drag and a bubble, unsteady: the flux is the wanted one in every step, and no cell loses gas over it.
TEST(Drive, MassFluxIsMetInEveryStepOfABed) {
  for (const GasMethod method : {GasMethod::simple, GasMethod::projection}) {
    GasSetup setup = still_air();
    setup.method = method;
    setup.gravity = {0, -9.81, 0};
    setup.faces[0] = {NoSlip{}, NoSlip{}};
    setup.drive[1].mass_flux = 0.6;
    setup.drive[1].schedule = {{{0, 0.5}, {2e-3, 1}}};
    setup.tolerance = setup.pressure_tolerance = 1e-6;
    GasBox box({9, 16, 4}, {0.045, 0.08, 0.02}, {false, true, true}, setup);
    fill_exchange(box, 800, 0.4);
    for (int n = 1; n <= 6; ++n) {
      set_fraction(box, [&](double x, double y, double z) {
        return 0.6 + 0.3 * std::sin(140 * x) * std::cos(2 * std::numbers::pi * (y / 0.08 - n * 0.02)) * std::cos(300 * z);
      });
      const GasOutcome outcome = box.step(5e-4, true);
      ASSERT_TRUE(outcome.converged) << outcome.reason;
      EXPECT_LT(outcome.iterations, 60);
      const double wanted = 0.6 * std::min(1.0, 0.5 + 0.5 * n / 4);
      EXPECT_NEAR(mean_flux(box, 1), wanted, 1e-13);  // round-off
      double lack = 0;
      box.for_cells([&](int i, int j, int k) { lack += std::abs(box.imbalance(i, j, k)); });
      EXPECT_LT(lack, 3e-6 * 0.5 * 0.045 * 0.02);  // tolerance, counted over three directions
    }
    EXPECT_GT(box.state.fall.y, 800 * 0.5);  // it carries the drag, ε_b of it
  }
}

TEST(MassInflow, BringsItsMassOverTheFaceOrARectangle) {
  const double flow = 2e-4;
  const Vec3 low{0.011, 0, 0.004}, high{0.031, 0, 0.017};
  const Schedule half{{{0, 0.5}}};
  for (const MassInflow& inflow : {MassInflow(flow, 1.2, 0.05 * 0.02, {}), MassInflow(flow, 1.2, 0.02 * 0.013, {}, low, high),
                                   MassInflow(2 * flow, 1.2, 0.02 * 0.013, half, low, high)}) {
    GasSetup setup = upright(0);
    setup.faces[1][0] = inflow;
    GasBox box({10, 12, 4}, {0.05, 0.06, 0.02}, {false, false, false}, setup);
    set_fraction(box, [](double x, double, double) { return 0.5 + 5 * x; });
    ASSERT_TRUE(box.step(1e-4).converged);
    EXPECT_NEAR(1.2 * box.solver.balance().in / flow, 1, 1e-13);  // round-off
  }
}

TEST(Schedule, IsLinearBetweenItsInstantsAndConstantBeyond) {
  const Schedule schedule{{{1, 0.2}, {2, 1}, {4, 0}}};
  for (const auto& [time, share] : {std::pair{0.0, 0.2}, {1.0, 0.2}, {1.5, 0.6}, {2.0, 1.0}, {3.0, 0.5}, {4.0, 0.0}, {9.0, 0.0}})
    EXPECT_DOUBLE_EQ(schedule.at(time), share) << time;
  EXPECT_EQ(Schedule{}.at(3), 1);
}

}  // namespace
}  // namespace bedflow
