// What drives the gas along periodic directions: GasState::fall, the fall of pressure per length beside that of p.
//
// Where a mass flux is wanted, every velocity of the direction is shifted by the same superficial velocity, which no cell's
// balance of volume notices, so that the mean of ρg ε u over the box is the wanted one to round-off; and the fall by what the
// momentum equations ask for that shift, so that outer iterations find the fall that keeps it.
#pragma once

#include "gas/gas_solver.h"
#include "grid/rows.h"

namespace bedflow {

class DrivenFlow {
 public:
  DrivenFlow(const Decomposition& decomposition, const Grid& grid, const GasSetup& setup);

  // Given falls and wanted fluxes are those of a time (s).
  void set_time(GasState& state, double time);
  // Collective. conductance: ε A D of a face (PressureCorrection), m³/s/Pa. Ghosts of the velocity are then out of date.
  void steer(GasState& state, const FaceField& conductance);

 private:
  const Decomposition& decomposition_;
  const Grid& grid_;
  const GasSetup& setup_;
  std::array<std::optional<double>, 3> wanted_;  // mean superficial velocity, m/s
  std::array<RowSum, 2> row_sums_;
};

}  // namespace bedflow
