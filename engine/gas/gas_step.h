// What a step of the gas needs, whichever way velocity and pressure are found: simple.cpp and projection.cpp are the two ways.
#pragma once

#include <sstream>

#include "gas/drive.h"
#include "gas/gas_solver.h"
#include "gas/momentum.h"
#include "gas/panels.h"
#include "gas/pressure.h"
#include "gas/workspace.h"
#include "grid/rows.h"

namespace bedflow {

struct GasStep {
  GasStep(const Decomposition& decomposition, const Grid& grid, Halo& halo, const GasSetup& setup, PhaseTimer& timer);

  // All that a step takes as given, at its end's time; ghosts right everywhere.
  void set_boundaries(GasState& state, double time, bool pressure_on_face);
  // Present rates, and Σ|∂ε/∂t| V.
  void measure(const GasState& state);
  // Why a box without outflow cannot take this step; empty: it can.
  std::string closed_box_fault(double dt) const;

  // From a state with its boundaries set to the velocity and pressure of the step's end.
  GasOutcome simple(GasState& state, const Momentum::Given& given);
  GasOutcome projection(GasState& state, const Momentum::Given& given);

  // The parts of both. Sums are over all ranks and components, with Σ|∂ε/∂t| V as throughput.
  struct MomentumOutcome {
    Momentum::Sums sums;
    double left = 0;    // share of the error that the sweeps leave at most
    std::string fault;  // why the equations cannot be solved, for people; empty: they can
  };
  // The residual of the momentum equations in the present state.
  MomentumOutcome check_momentum(const GasState& state, const Momentum::Given& given);
  // The same, and the velocity becomes the solution but for this share of the error; with a fault it is left anyhow.
  MomentumOutcome solve_momentum(GasState& state, const Momentum::Given& given, double leave);
  // The pressure correction, solved to setup.pressure_tolerance or Σ|imbalance| ≤ enough (m³/s), added in full to the velocity
  // and by `share` to the pressure; wanted fluxes met; ghosts right. renew: the preconditioner (pressure.h).
  PressureCorrection::Result correct(GasState& state, double enough, double share, bool renew = true);

  const Decomposition& decomposition;
  const Grid& grid;
  Halo& halo;
  const GasSetup setup;
  PhaseTimer& timer;
  Boundaries boundaries;
  Panels panels;
  Workspace work;
  PressureCorrection pressure;
  Momentum momentum;
  DrivenFlow driven;
  FaceField old_velocity;
  Field old_pressure;
  Vec3 old_fall;
  GasBalance balance;
  double displacement = 0;  // Σ|∂ε/∂t| V, m³/s
  std::array<RowSum, 2> row_sums;

 private:
  void conclude(MomentumOutcome& outcome) const;
};

// Parts of a message for people.
template <class... Parts>
std::string join(const Parts&... parts) {
  std::ostringstream text;
  text.precision(3);
  (text << ... << parts);
  return text.str();
}

}  // namespace bedflow
