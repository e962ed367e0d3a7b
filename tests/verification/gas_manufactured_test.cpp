// Manufactured solutions: fields are chosen, the momentum source that makes them a solution is worked out exactly (Roache 1998),
// and the solver must return them with the order of its scheme.
#include <gtest/gtest.h>

#include <numbers>

#include "gas_box.h"
#include "support/smooth.h"

namespace bedflow {
namespace {

constexpr double pi = std::numbers::pi;

struct Flow {
  Smooth fraction, pressure;
  std::array<Smooth, 3> flux;  // εU
};
using Exact = Flow (*)(const Smooth& x, const Smooth& y, const Smooth& z, const Smooth& t);

// In boxes of edge 1 with no-slip walls: εU vanishes on all of them.
Flow eddy(const Smooth& x, const Smooth& y, const Smooth&, const Smooth&) {
  return {1,
          cos(pi * x) * cos(pi * y),
          {sin(pi * x) * sin(pi * x) * sin(2 * pi * y), -1 * sin(2 * pi * x) * sin(pi * y) * sin(pi * y), 0}};
}
Flow eddies(const Smooth& x, const Smooth& y, const Smooth& z, const Smooth&) {
  const Smooth a = sin(pi * x), b = sin(pi * y), c = sin(pi * z);
  const Smooth a2 = sin(2 * pi * x), b2 = sin(2 * pi * y), c2 = sin(2 * pi * z);
  return {1, cos(pi * x) * cos(pi * y) * cos(2 * pi * z), {2 * a * a * b2 * c2, -1 * a2 * b * b * c2, -1 * a2 * b2 * c * c}};
}
Flow eddy_in_a_bed(const Smooth& x, const Smooth& y, const Smooth& z, const Smooth& t) {
  Flow flow = eddy(x, y, z, t);
  flow.fraction = 0.7 + 0.2 * cos(2 * pi * x + 1) * sin(pi * y);
  return flow;
}
Flow eddies_in_a_bed(const Smooth& x, const Smooth& y, const Smooth& z, const Smooth& t) {
  Flow flow = eddies(x, y, z, t);
  flow.fraction = 0.7 + 0.2 * cos(2 * pi * x + 1) * sin(pi * y) * cos(pi * z);
  return flow;
}
// ∂ε/∂t is balanced by a flux of its own along x.
Flow eddy_in_a_breathing_bed(const Smooth& x, const Smooth& y, const Smooth& z, const Smooth& t) {
  Flow flow = eddy(x, y, z, t);
  const Smooth shape = sin(pi * y) * sin(pi * y), rate = 4 * 0.2 * cos(4 * t);
  flow.fraction = 0.7 + 0.2 * sin(4 * t) * cos(2 * pi * x) * shape;
  flow.flux[0] = flow.flux[0] - rate * sin(2 * pi * x) * shape / (2 * pi);
  return flow;
}

// From an inflow at x = 0 to an outflow at x = 1 between free-slip walls: no gradient along x at either, as they want it.
Flow stream(const Smooth& x, const Smooth& y, const Smooth&, const Smooth&) {
  const Smooth swell = x * x * (6 - 8 * x + 3 * x * x), slope = 12 * x * (1 - x) * (1 - x);
  return {0.8 + 0.1 * cos(pi * x) * cos(pi * y),
          cos(pi / 2 * x) * cos(pi * y),
          {1 + 0.3 * swell * cos(pi * y), -0.3 / pi * slope * sin(pi * y), 0}};
}

struct Problem {
  Exact exact = eddy;
  bool three = false;  // dimensions
  GasSetup setup;
  double drag = 0;  // kg/m³s, of particles at rest, whose buoyancy is that of 1 − ε
  bool particles = false;

  Flow at(double x, double y, double z, double t) const {
    return exact(Smooth::variable(0, x), Smooth::variable(1, y), Smooth::variable(2, z), Smooth::variable(3, t));
  }
  static std::array<Smooth, 3> velocity(const Flow& flow) {
    return {flow.flux[0] / flow.fraction, flow.flux[1] / flow.fraction, flow.flux[2] / flow.fraction};
  }
  // What the momentum equation of component d lacks, N/m³.
  double source(int d, const Flow& flow) const {
    const auto u = velocity(flow);
    double carried = u[d].slope[3], viscous = 0;
    for (int a = 0; a < 3; ++a) {
      carried += u[a].value * u[d].slope[a];
      viscous += u[d].bend[a][a] + u[a].bend[a][d] / 3;
    }
    const double share = particles ? flow.fraction.value : 1;
    return setup.density * flow.fraction.value * carried + share * flow.pressure.slope[d] - setup.viscosity * viscous +
           drag * u[d].value;
  }
};

Problem problem(Exact exact, bool three, const Convection& convection) {
  Problem result{.exact = exact, .three = three, .setup = still_air()};
  result.setup.density = 1;
  result.setup.viscosity = 0.1;
  result.setup.convection = convection;
  result.setup.tolerance = 1e-5;
  result.setup.max_iterations = 3000;
  for (auto& pair : result.setup.faces) pair = {NoSlip{}, NoSlip{}};
  return result;
}

Vec3 face_place(const GasBox& box, int d, int i, int j, int k) {
  Vec3 at{box.centre(0, i), box.centre(1, j), box.centre(2, k)};
  at[d] -= 0.5 * box.grid.spacing[d];
  return at;
}

// Exchange and ε for a step from t − dt to t.
void load(GasBox& box, const Problem& problem, double t, double dt) {
  box.for_cells([&](int i, int j, int k) {
    const double x = box.centre(0, i), y = box.centre(1, j), z = box.centre(2, k);
    const double now = problem.at(x, y, z, t).fraction.value, before = problem.at(x, y, z, t - dt).fraction.value;
    box.state.fraction(i, j, k) = now;
    box.state.fraction_rate(i, j, k) = (now - before) / dt;
  });
  for (int d = 0; d < 3; ++d)
    for_solved(box, d, [&, d](int i, int j, int k) {
      const Vec3 at = face_place(box, d, i, j, k);
      const Flow flow = problem.at(at.x, at.y, at.z, t);
      const int index[3] = {i, j, k};
      const double volume = (index[d] == box.grid.cells[d] ? 0.5 : 1) * box.grid.cell_volume();  // half before an outflow
      box.exchange.drag[d](i, j, k) = problem.drag * volume;
      box.exchange.drag_momentum[d](i, j, k) = problem.source(d, flow) * volume;
      box.exchange.buoyancy[d](i, j, k) = problem.particles ? 1 - flow.fraction.value : 0;
    });
}

void set_exact(GasBox& box, const Problem& problem, double t) {
  for (int d = 0; d < 3; ++d)
    for_solved(box, d, [&, d](int i, int j, int k) {
      const Vec3 at = face_place(box, d, i, j, k);
      box.state.velocity[d](i, j, k) = Problem::velocity(problem.at(at.x, at.y, at.z, t))[d].value;
    });
  box.for_cells([&](int i, int j, int k) {
    box.state.pressure(i, j, k) = problem.at(box.centre(0, i), box.centre(1, j), box.centre(2, k), t).pressure.value;
  });
}

struct Error {
  double velocity = 0, pressure = 0;  // means of absolute values
};
Error error(const GasBox& box, const Problem& problem, double t) {
  Error result;
  double faces = 0, cells = 0, offset = 0;
  for (int d = 0; d < 3; ++d)
    for_solved(box, d, [&, d](int i, int j, int k) {
      const Vec3 at = face_place(box, d, i, j, k);
      const double exact = Problem::velocity(problem.at(at.x, at.y, at.z, t))[d].value;
      result.velocity += std::abs(box.state.velocity[d](i, j, k) - exact);
      ++faces;
    });
  const auto lack = [&](int i, int j, int k) {
    const Flow flow = problem.at(box.centre(0, i), box.centre(1, j), box.centre(2, k), t);
    return box.state.pressure(i, j, k) - flow.pressure.value;
  };
  box.for_cells([&](int i, int j, int k) {
    offset += lack(i, j, k);
    ++cells;
  });
  box.for_cells([&](int i, int j, int k) { result.pressure += std::abs(lack(i, j, k) - offset / cells); });
  return {result.velocity / faces, result.pressure / cells};
}

Error steady(const Problem& problem, int n, double change = 1e-4) {
  const int deep = problem.three ? n : 1;
  GasBox box({n, n, deep}, {1, 1, problem.three ? 1 : 0.5}, {false, false, !problem.three}, problem.setup);
  set_exact(box, problem, 0);
  load(box, problem, 0, 1);
  EXPECT_TRUE(box.settle(0.2, change, 200, true)) << n;
  return error(box, problem, 0);
}

Error unsteady(const Problem& problem, int n, int steps, double end) {
  GasBox box({n, n, 1}, {1, 1, 0.5}, {false, false, true}, problem.setup);
  const double dt = end / steps;
  load(box, problem, 0, dt);
  set_exact(box, problem, 0);
  for (int step = 1; step <= steps; ++step) {
    load(box, problem, step * dt, dt);
    const GasOutcome outcome = box.step(dt, true);
    EXPECT_TRUE(outcome.converged) << n << ", " << step << ": " << outcome.reason;
    if (!outcome.converged) break;
  }
  return error(box, problem, end);
}

std::string name(const Convection& scheme) {
  return std::visit([](auto s) { return s.name; }, scheme);
}

// 0.25: both come near their order from below, at 12 to 20 cells for each eddy.
void expect_order(const Convection& scheme, const Error& coarse, const Error& fine, double margin = 0.25) {
  const double order = std::holds_alternative<Upwind>(scheme) ? 1 : 2;
  EXPECT_NEAR(std::log2(coarse.velocity / fine.velocity), order, margin) << name(scheme);
  EXPECT_NEAR(std::log2(coarse.pressure / fine.pressure), order, margin) << name(scheme);
}

TEST(Manufactured, EddyOfOneGasHasTheOrderOfItsScheme) {
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{})}) {
    const Problem p = problem(eddy, false, scheme);
    expect_order(scheme, steady(p, 20), steady(p, 40));
  }
}

TEST(Manufactured, EddiesInThreeDimensionsHaveTheOrderOfTheirScheme) {
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{})}) {
    const Problem p = problem(eddies, true, scheme);
    expect_order(scheme, steady(p, 16), steady(p, 32));
  }
}

TEST(Manufactured, FractionThatVariesInSpaceKeepsTheOrder) {
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{})}) {
    const Problem p = problem(eddy_in_a_bed, false, scheme);
    expect_order(scheme, steady(p, 20), steady(p, 40));
  }
}

TEST(Manufactured, DragAndBuoyancyOfABedKeepTheOrder) {
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{})}) {
    Problem p = problem(eddies_in_a_bed, true, scheme);
    p.particles = true;
    p.drag = 1;
    expect_order(scheme, steady(p, 16), steady(p, 32));
  }
}

TEST(Manufactured, StreamFromInflowToOutflowKeepsTheOrder) {
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{})}) {
    Problem p = problem(stream, false, scheme);
    p.setup.tolerance = 1e-7;
    p.setup.faces = {{{Inflow{{1, 0, 0}, {}}, Outflow{}}, {FreeSlip{}, FreeSlip{}}, {NoSlip{}, NoSlip{}}}};
    expect_order(scheme, steady(p, 24, 1e-6), steady(p, 48, 1e-6));
  }
}

// Steps as the square of the cells: the error in time, of first order, falls with that in space.
TEST(Manufactured, FractionThatVariesInTimeKeepsTheOrder) {
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{})}) {
    const Problem p = problem(eddy_in_a_breathing_bed, false, scheme);
    expect_order(scheme, unsteady(p, 16, 10, 0.3), unsteady(p, 32, 40, 0.3));
  }
}

// A projection's steps of half a cell's passage, from the exact fields to where they have settled.
TEST(Manufactured, ProjectionHasTheSameOrders) {
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{})}) {
    Problem p = problem(eddy_in_a_bed, false, scheme);
    p.setup.method = GasMethod::projection;
    p.setup.tolerance = 1e-4;
    p.setup.pressure_tolerance = 1e-6;
    expect_order(scheme, unsteady(p, 20, 40, 1), unsteady(p, 40, 80, 1));
    p.exact = eddy_in_a_breathing_bed;
    expect_order(scheme, unsteady(p, 16, 10, 0.3), unsteady(p, 32, 40, 0.3));
  }
}

// It steepens every extremum over a few cells, and reaches its order where these are a small part: twice the grid of SMART.
TEST(Manufactured, SuperbeeReachesOrderTwoOnFineGrids) {
  const Problem p = problem(eddy_in_a_bed, false, Superbee{});
  expect_order(Superbee{}, steady(p, 40), steady(p, 80), 0.15);
}

TEST(Manufactured, FluxesOfTheSolutionsObeyContinuity) {
  for (const Exact exact : {eddy, eddies, eddy_in_a_bed, eddies_in_a_bed, eddy_in_a_breathing_bed, stream}) {
    const Flow flow = Problem{.exact = exact, .setup = {}}.at(0.13, 0.37, 0.71, 0.2);
    EXPECT_NEAR(flow.fraction.slope[3] + flow.flux[0].slope[0] + flow.flux[1].slope[1] + flow.flux[2].slope[2], 0, 1e-14);
  }
}

}  // namespace
}  // namespace bedflow
