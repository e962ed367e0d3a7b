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
#pragma once

#include <array>
#include <vector>

#include "gas/boundaries.h"
#include "gas/gas_solver.h"
#include "gas/panels.h"
#include "grid/halo.h"
#include "grid/rows.h"

namespace bedflow {

class Momentum {
 public:
  Momentum(const Decomposition& decomposition, const Grid& grid, Halo& halo, const GasSetup& setup, const Boundaries& boundaries,
           const Panels& panels);

  // What stays the same over the outer iterations of a step of dt (s). old_velocity: at the step's start. The state's ε has its
  // ghosts. False: on this rank ε° or ε_b is not positive somewhere.
  [[nodiscard]] bool begin(const GasState& state, const FaceField& old_velocity, const Exchange* exchange, double dt);

  // Forces of this rank, N, summed over its faces, and the volume flow that they and the velocity stand for.
  struct Sums {
    double imbalance = 0;  // |what the equation of the present fields lacks|
    double force = 0;      // |pressure| + |ρ u²/L, μ u/L²| + |inertia, drag and weight together| + |imbalance|: knows no grid
    double throughput = 0;  // volume flow through a mean cross-section of each direction, m³/s
    double coupling = 0;    // the largest Σa over the relaxed diagonal (below 1): how strongly faces hang together; a maximum
  };
  // The equations about the present velocity and pressure (outflow ghosts: pressure on the face), and their residual there. All
  // ghosts are right, beyond the faces of the box too.
  Sums assemble(const GasState& state);
  // Gauss–Seidel sweeps, there and back, of the relaxed equations of each component: as many as the coupling (the largest of all
  // ranks) asks for to leave this share of the error, or the most that are worth while. Returns the share that they leave at
  // most.
  double solve(FaceField& velocity, double coupling, double leave);

  // After assemble: what a pressure difference over a face does to its velocity, m/s/Pa; 0 where none is solved. With Σa left
  // out of the diagonal (SIMPLEC: Van Doormaal & Raithby 1984).
  const FaceField& mobility() const { return mobility_; }
  // After begin: ε on faces.
  const FaceField& fraction() const { return fraction_; }

 private:
  struct Equations {
    std::array<Field, 6> neighbour;  // a; 2·direction + side
    Field diagonal, source;          // without Σa; without pressure
  };

  void begin_component(int d, const GasState& state, const Field& old_velocity, const Exchange* exchange, double dt);
  void set_fluxes(const FaceField& velocity);
  void assemble_inside(int d, const double* p, double fall);
  void assemble_outflow(int d, int side, const double* p);
  void apply_boundary(int d, int t, int side);
  void begin_panels();
  void apply_panels(int d, const double* u);
  void correct_convection(int d, const double* u);
  template <class Scheme>
  void correct_along(const Scheme& scheme, int d, int t, const double* u);
  void relax(int d, const double* u, Sums& sums);
  void sweep(int d, int direction, double* u);
  std::ptrdiff_t step_above(std::ptrdiff_t row, int n) const;
  Int3 low_solved(int d) const;
  Int3 high_solved(int d) const;

  const Decomposition& decomposition_;
  const Grid& grid_;
  Halo& halo_;
  const GasSetup& setup_;
  const Boundaries& boundaries_;
  const Panels& panels_;

  Field old_fraction_;                 // ε°
  FaceField fraction_;                 // ε
  FaceField local_, constant_, push_;  // ρg ε° V/Δt + Σb; that and the forces which do not change; ε_b A
  FaceField flux_;                     // ρg ε u A
  Field divergence_;                   // ∇·U
  Field correction_;                   // |F| (u_face − u_upstream) through a side; with schemes beyond upwind
  std::array<Equations, 3> equations_;
  FaceField mobility_;
  std::array<RowSum, 3> row_sums_;
  std::vector<double> coupling_, row_, carry_;
};

}  // namespace bedflow
