// Watches that contacts create no energy. Springs give back what they took, dashpots and friction take more: over any time
//   work on the particles − work of walls that move ≤ energy stored at the start − energy stored at the end.
// Gas, gravity, what enters and what leaves are not in it. Where the motion is integrated too coarsely for its contacts, the left
// side grows without end; it is found when it rivals all the energy that the particles and the springs have.
//
// The work is summed in the sub-steps, as the particles move. What is stored is asked for once in `span` steps, and the end is
// taken as 0 until then; with attraction, whose potential is below 0, at every step. A look is a reduction of one number, a
// second one only where it is above 0.
#pragma once

#include "base/stop.h"
#include "parallel/comm.h"
#include "particles/dem.h"

namespace bedflow {

class EnergyWatch {
 public:
  // limit: of what is created over the kinetic and the stored energy; 0: nothing is watched.
  explicit EnergyWatch(double limit) : limit_(limit) {}

  // Before the sub-steps of a step.
  void prepare(Dem& dem);
  // After them. Notes what is beyond the limit, as DIVERGED, on all ranks. Collective.
  void look(const Dem& dem, const Comm& comm, Failure& failure);
  // The next step begins anew: the contacts have become others.
  void begin() { steps_ = 0; }

 private:
  static constexpr int span = 16;

  double limit_;
  int steps_ = 0;  // since the account was opened
};

}  // namespace bedflow
