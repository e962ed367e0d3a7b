// A box of gas for the tests: decomposition, grid, halo, state and solver together.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <string>

#include "gas/gas_solver.h"

namespace bedflow {

struct GasBox {
  GasBox(Int3 cells, Vec3 size, std::array<bool, 3> periodic, const GasSetup& setup, const Comm& comm = Comm::self(),
         int tall = -1)
      : decomposition(comm, cells, size, periodic, tall),
        grid(decomposition, ghosts_of(setup.convection)),
        halo(decomposition, grid, timer),
        solver(decomposition, grid, halo, setup, timer),
        state(grid),
        exchange(grid) {
    solver.prepare(state, 0);
  }
  GasBox(const GasBox&) = delete;
  GasBox& operator=(const GasBox&) = delete;

  // One step; with: whether the exchange with particles counts.
  GasOutcome step(double dt, bool with_exchange = false) {
    GasOutcome outcome = solver.advance(state, with_exchange ? &exchange : nullptr, time, dt);
    if (outcome.converged) time += dt;
    return outcome;
  }
  // Steps until no velocity moves by more than `change` of the fastest in one; false: not within `most` or not converged.
  bool settle(double dt, double change, int most, bool with_exchange = false) {
    for (int n = 0; n < most; ++n) {
      const FaceField before = state.velocity;
      if (!step(dt, with_exchange).converged) return false;
      double moved = 0, fastest = 0;
      for (int d = 0; d < 3; ++d)
        for (std::size_t i = 0; i < grid.size(); ++i) {
          moved = std::max(moved, std::abs(state.velocity[d].data()[i] - before[d].data()[i]));
          fastest = std::max(fastest, std::abs(state.velocity[d].data()[i]));
        }
      if (decomposition.comm().max(moved) <= change * decomposition.comm().max(fastest)) return true;
    }
    return false;
  }
  // What a cell lacks, m³/s: Σ ε u A outward + V ∂ε/∂t.
  double imbalance(int i, int j, int k) const {
    const Field &e = state.fraction, *u = state.velocity.component.data();
    const auto flow = [&](int d, int a, int b, int c) {
      const int before[3] = {a - (d == 0), b - (d == 1), c - (d == 2)};
      return grid.face_area(d) * 0.5 * (e(before[0], before[1], before[2]) + e(a, b, c)) * u[d](a, b, c);
    };
    return flow(0, i + 1, j, k) - flow(0, i, j, k) + flow(1, i, j + 1, k) - flow(1, i, j, k) + flow(2, i, j, k + 1) -
           flow(2, i, j, k) + grid.cell_volume() * state.fraction_rate(i, j, k);
  }
  void for_cells(const std::function<void(int, int, int)>& act) const {
    for (int k = 0; k < grid.cells[2]; ++k)
      for (int j = 0; j < grid.cells[1]; ++j)
        for (int i = 0; i < grid.cells[0]; ++i) act(i, j, k);
  }
  // m, of a cell's centre.
  double centre(int d, int index) const { return grid.low[d] + (index + 0.5) * grid.spacing[d]; }

  Decomposition decomposition;
  Grid grid;
  PhaseTimer timer;
  Halo halo;
  GasSolver solver;
  GasState state;
  Exchange exchange;
  double time = 0;
};

// Closed by free-slip walls all round, for each test to change.
inline GasSetup still_air() {
  GasSetup setup;
  setup.density = 1.2;
  setup.viscosity = 1.8e-5;
  for (auto& pair : setup.faces) pair = {FreeSlip{}, FreeSlip{}};
  return setup;
}

// Tests that hold whichever way the step is made.
class EitherMethod : public testing::TestWithParam<GasMethod> {
 protected:
  // The setup by the method of the test; the one pressure solve of a projection does what many of SIMPLE do.
  static GasSetup by_method(GasSetup setup) {
    setup.method = GetParam();
    if (setup.method == GasMethod::projection) setup.pressure_tolerance = std::max(1e-13, 0.01 * setup.tolerance);
    return setup;
  }
};
inline const auto either_method = testing::Values(GasMethod::simple, GasMethod::projection);
inline std::string method_name(const testing::TestParamInfo<GasMethod>& info) {
  return info.param == GasMethod::simple ? "simple" : "projection";
}

// Upright channel: inflow below, outflow above, walls beside.
inline GasSetup upright(double inflow) {
  GasSetup setup = still_air();
  setup.gravity = {0, -9.81, 0};
  setup.faces[0] = {NoSlip{}, NoSlip{}};
  setup.faces[1] = {Inflow{{inflow, 0, 0}, {}}, Outflow{0}};
  return setup;
}

inline void set_fraction(GasBox& box, const std::function<double(double, double, double)>& epsilon) {
  box.for_cells(
      [&](int i, int j, int k) { box.state.fraction(i, j, k) = epsilon(box.centre(0, i), box.centre(1, j), box.centre(2, k)); });
}

inline void for_solved(const GasBox& box, int d, const std::function<void(int, int, int)>& act) {
  const GasSolver::Range range = box.solver.solved_faces(d);
  Int3 low{0, 0, 0}, high = box.grid.cells;
  low[d] = range.low;
  high[d] = range.high + 1;
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; ++j)
      for (int i = low[0]; i < high[0]; ++i) act(i, j, k);
}

// A bed of given drag density (kg/m³s) and solids fraction in the whole box, the same on every control volume; moving at `speed`.
inline void fill_exchange(GasBox& box, double drag, double solids, Vec3 speed = {}) {
  for (int d = 0; d < 3; ++d)
    for_solved(box, d, [&, d](int i, int j, int k) {
      const int at[3] = {i, j, k};
      const bool half = at[d] == box.grid.cells[d] && box.solver.solved_faces(d).high == at[d];
      box.exchange.drag[d](i, j, k) = drag * box.grid.cell_volume() * (half ? 0.5 : 1);
      box.exchange.drag_momentum[d](i, j, k) = box.exchange.drag[d](i, j, k) * speed[d];
      box.exchange.buoyancy[d](i, j, k) = solids;
    });
}

// A bed at rest, ε = 0.45 and of given drag density (kg/m³s), in the lower half of a box 0.12 m and 24 cells high: the
// coefficients jump at its surface.
inline void fill_lower_half(GasBox& box, double drag) {
  set_fraction(box, [](double, double y, double) { return y < 0.06 ? 0.45 : 1.0; });
  for (int d = 0; d < 3; ++d)
    for_solved(box, d, [&, d](int i, int j, int k) {
      if (j > 12) return;
      box.exchange.drag[d](i, j, k) = drag * box.grid.cell_volume();
      box.exchange.buoyancy[d](i, j, k) = 0.55;
    });
}

}  // namespace bedflow
