// What a step of the gas needs, whichever way velocity and pressure are found: simple.cpp and projection.cpp are the two ways.
#pragma once

#include <sstream>

#include "gas/drive.h"
#include "gas/gas_solver.h"
#include "gas/momentum.h"
#include "gas/panels.h"
#include "gas/pressure.h"

namespace bedflow {

struct GasStep {
  GasStep(const Decomposition& decomposition, const Grid& grid, Halo& halo, const GasSetup& setup, PhaseTimer& timer);

  // All that a step takes as given, at its end's time; ghosts right everywhere.
  void set_boundaries(GasState& state, double time, bool pressure_on_face);
  // Present rates, and Σ|∂ε/∂t| V.
  void measure(const GasState& state);
  // Why a box without outflow cannot take this step; empty: it can.
  std::string closed_box_fault(double dt) const;
  // Why what the momentum equations take as given cannot be; empty: it can. Collective.
  std::string begin(const GasState& state, const Exchange* exchange, double dt);

  // After begin, from a state with its boundaries set: to the velocity and pressure of the step's end.
  GasOutcome simple(GasState& state);
  GasOutcome projection(GasState& state);

  // The parts of both. The momentum equations about the present state, with sums and maximum over all ranks; Σ|∂ε/∂t| V counts as
  // throughput.
  Momentum::Sums assemble(const GasState& state);
  // Sweeps of the momentum equations until they leave this share of the error; returns what they do leave.
  double solve_momentum(GasState& state, double coupling, double leave);
  // The pressure correction, solved to setup.pressure_tolerance or Σ|imbalance| ≤ enough (m³/s), added in full to the velocity
  // and by `share` to the pressure; wanted fluxes met; ghosts right.
  PressureCorrection::Result correct(GasState& state, double enough, double share);

  const Decomposition& decomposition;
  const Grid& grid;
  Halo& halo;
  const GasSetup setup;
  PhaseTimer& timer;
  Boundaries boundaries;
  Panels panels;
  Momentum momentum;
  DrivenFlow driven;
  PressureCorrection pressure;
  FaceField old_velocity;
  Field old_pressure;
  Vec3 old_fall;
  GasBalance balance;
  double displacement = 0;  // Σ|∂ε/∂t| V, m³/s
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
