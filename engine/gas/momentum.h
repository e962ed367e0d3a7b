// The linearised momentum equation of each velocity component on its own staggered control volumes.
//
// Continuity times U is subtracted, which leaves, over the control volume V of a face with upwind convection (Patankar 1980,
// ch. 5 and 6; other schemes add a correction, momentum_convection.cpp),
//
//   [ρg ε° V/Δt + Σ a + Σb] u = Σ a_nb u_nb + ρg ε° V/Δt u° + ε_b A (p_low − p_high) + Σ b V_d + ε_b ρg g V
//                               + (μ/3) A (∇·U_high − ∇·U_low),        a = μ A/h + max(−F, 0),
//
// ε° = ε − Δt ∂ε/∂t and u° of the step's start, F the gas mass leaving through a side, and (1/3)μ∇(∇·U) what ∇·σ holds beside
// μ∇²U. On an outflow V is the half cell before the face; gas that comes back is taken to start from rest.
//
// Only transport is relaxed (Σa/α on the diagonal): inertia and drag stand on the diagonal as they are and need none.
//
// One component is assembled and solved at a time, all with the fluxes of the same velocity: their equations need no more room
// than those of one.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "gas/boundaries.h"
#include "gas/gas_solver.h"
#include "gas/panels.h"
#include "gas/workspace.h"
#include "grid/halo.h"
#include "grid/rows.h"

namespace bedflow {

class Momentum {
 public:
  Momentum(const Decomposition& decomposition, const Grid& grid, Halo& halo, const GasSetup& setup, const Boundaries& boundaries,
           const Panels& panels, Workspace& work, FaceField& mobility);

  // What stays the same over the outer iterations of a step.
  struct Given {
    const FaceField* old_velocity = nullptr;  // at the step's start
    const Exchange* exchange = nullptr;       // null: no particles
    double dt = 0;                            // s
  };
  // The fluxes of a velocity, for all components. All ghosts are right, those of ε and ∂ε/∂t too.
  void set_fluxes(const GasState& state);

  // Forces of this rank, N, summed over its faces, and the volume flow that they and the velocity stand for.
  struct Sums {
    double imbalance = 0;  // |what the equation of the present fields lacks|
    double force = 0;      // |pressure| + |ρ u²/L, μ u/L²| + |inertia, drag and weight together| + |imbalance|: knows no grid
    double throughput = 0;  // volume flow through a mean cross-section of each direction, m³/s
    double coupling = 0;    // the largest Σa over the relaxed diagonal (below 1): how strongly faces hang together; a maximum
    double unsound = 0;     // faces at which ε° or ε_b is not positive

    Sums& operator+=(const Sums& b) {
      imbalance += b.imbalance, force += b.force, throughput += b.throughput, unsound += b.unsound;
      coupling = std::max(coupling, b.coupling);
      return *this;
    }
  };
  // The equations of component d about the present velocity and pressure (outflow ghosts: pressure on the face) with the fluxes
  // that are set, and their residual. Sets the component's mobility, with Σa left out of the diagonal (SIMPLEC: Van Doormaal &
  // Raithby 1984).
  Sums assemble(int d, const GasState& state, const Given& given);
  // Gauss–Seidel sweeps, there and back, of the relaxed equations that are assembled, sound or not: as many as the coupling (the
  // largest of all ranks) asks for to leave this share of the error, or the most that are worth while. Returns the share that
  // they leave at most.
  double solve(int d, Field& velocity, double coupling, double leave);

 private:
  double begin_component(int d, const GasState& state, const Given& given);
  void assemble_inside(int d, const double* p, double fall);
  void assemble_outflow(int d, int side, const double* p);
  void apply_boundary(int d, int t, int side);
  void apply_panels(int d, const GasState& state);
  void correct_convection(int d, const double* u);
  template <class Scheme>
  void correct_along(const Scheme& scheme, int d, int t, const double* u);
  void relax(int d, const GasState& state, Sums& sums);
  void sweep(int d, int direction, double* u);
  // For what is done to the control volumes of component d; on an outflow along x two kinds of them stand in a row.
  template <class Row>
  void for_volumes(int d, Int3 low, Int3 high, Row row) const {
    if (d == 0 && (boundaries_.outflow(0, 0) || boundaries_.outflow(0, 1))) return for_rows(grid_, low, high, row);
    for_joined_rows(grid_, low, high, row);
  }
  std::ptrdiff_t step_above(std::ptrdiff_t row, int n) const;
  Int3 low_solved(int d) const;
  Int3 high_solved(int d) const;

  const Decomposition& decomposition_;
  const Grid& grid_;
  Halo& halo_;
  const GasSetup& setup_;
  const Boundaries& boundaries_;
  const Panels& panels_;

  FaceField flux_;    // ρg ε u A
  Field divergence_;  // ∇·U
  Field correction_;  // |F| (u_face − u_upstream) through a side; with schemes beyond upwind
  // Of one component:
  std::array<Field*, 6> neighbour_;  // a; 2·direction + side
  Field &diagonal_, &source_;        // first without, then with Σa, and inverted; without the pressure of neighbours
  Field& constant_;                  // of the source: ρg ε° V/Δt u° and the forces that do not change with U and p
  FaceField& mobility_;              // ε_b A until the diagonal is known
  std::array<RowSum, 3> row_sums_;
  RowSum largest_;  // of couplings
  std::vector<double> row_, carry_;
};

}  // namespace bedflow
