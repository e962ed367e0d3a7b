// Watches the state after every step: a bed that has come apart numerically is stopped where it happened.
//
// A look costs a comparison per particle and per cell; who is to blame is searched for only when something is wrong. A number
// that is none fails every comparison.
#pragma once

#include "base/stop.h"
#include "coupling/transfer.h"
#include "grid/grid.h"
#include "particles/dem.h"
#include "scene.h"

namespace bedflow {

// The largest Σ|U|/h of a cell of this block, 1/s: times dt it is the Courant number.
double fastest_transport(const Grid& grid, const FaceField& velocity);

// Each notes in `failure` what is beyond the limits, as DIVERGED. deepest: largest overlap in the step over the sum of the radii,
// this rank; substep, dt: s.
void watch_particles(const GuardSetup& limits, const Dem& dem, double deepest, double substep, Failure& failure);
void watch_gas(const GuardSetup& limits, const Grid& grid, const FaceField& velocity, double dt, Failure& failure);
void watch_fraction(const GuardSetup& limits, const Grid& grid, const Transfer::Lowest& lowest, Failure& failure);

}  // namespace bedflow
