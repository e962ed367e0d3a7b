// The pressure equation of both solvers: p' such that the velocities u' = D (p'_low − p'_high), added, leave no cell out of
// balance,
//
//   Σ_faces ε A D (p'_c − p'_beyond) = −(Σ_faces ε u A outward + V ∂ε/∂t),        D: mobility of a face (Momentum).
//
// p' is 0 beyond an outflow. Without one it is free by a constant.
#pragma once

#include "gas/boundaries.h"
#include "gas/conjugate_gradients.h"

namespace bedflow {

class PressureCorrection {
 public:
  // upright: of the multigrid.
  PressureCorrection(const Decomposition& decomposition, const Grid& grid, Halo& halo, const Boundaries& boundaries,
                     Preconditioner preconditioner, Workspace& work, int upright = -1);

  // What a pressure difference over a face does to its velocity, m/s/Pa; 0 where none is solved. To be set before assemble, which
  // makes the equation of it and leaves ε A D in its place.
  FaceField& mobility() { return matrix_.coupling; }
  // ε has its ghosts. Not renewed, the preconditioner stays that of an earlier matrix, which should be much like this one.
  void assemble(const Field& fraction, bool renew = true);
  // The right side for a velocity with its ghosts.
  void set_imbalance(const Field& fraction, const FaceField& velocity, const Field& fraction_rate);

  struct Result {
    int iterations = 0;
    bool reached = false;  // one of the two aims
    double imbalance = 0;  // Σ|what the cells lack after the correction| over all ranks, m³/s; not finite: it failed
  };
  // Until the residual has come down to `reduction` of the first, or its root mean square to `enough` (m³/s). Collective.
  Result solve(double reduction, double enough);
  // Adds u' to the velocity's solved faces and share × p' to the pressure; their ghosts are then out of date.
  void correct(FaceField& velocity, Field& pressure, const Field& fraction, double share);

  const SevenPoint& matrix() const { return matrix_; }

 private:
  const Decomposition& decomposition_;
  const Grid& grid_;
  Halo& halo_;
  const Boundaries& boundaries_;
  bool open_;  // p is given somewhere
  SevenPoint matrix_;
  ConjugateGradients solver_;
  Field &correction_, &residual_;
  RowSum row_sum_;
};

}  // namespace bedflow
