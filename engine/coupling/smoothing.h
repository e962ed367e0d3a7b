// Spreads densities on by diffusion, until a hat of the grid's width has the width of a Gaussian.
//
// Explicit steps of ∂c/∂t = ∇·(D ∇c), a direction at a time, without flux through the faces of the box; m is the node volume:
//   m_i c_i' = m_i c_i + α (c_{i+1} − c_i) + α (c_{i−1} − c_i),   α = D Δt/h² ≤ 1/6
// They keep Σ m c and every constant. As an operator on amounts m c a step is the transpose of itself on values c: deposits,
// divided by their node volume, and sampled fields go through the same call. n steps and the hat have the variance 2 α n h² +
// h²/6, the hat's averaged over places; it is made σ². With α = 1/6 the fourth moment is a Gaussian's too.
#pragma once

#include <vector>

#include "coupling/lattices.h"
#include "grid/halo.h"

namespace bedflow {

class Smoothing {
 public:
  // deviation: σ, m.
  Smoothing(const Grid& grid, const Lattices& lattices, Halo& halo, double deviation);

  // A field on a lattice, right on this rank's own points; its ghosts are filled afterwards. Collective.
  void apply(Field& field, int lattice);
  void apply(FaceField& field) {
    for (int d = 0; d < 3; ++d) apply(field[d], d);
  }

 private:
  void step(Field& field, int lattice, int d);

  const Grid& grid_;
  const Lattices& lattices_;
  Halo& halo_;
  int steps_[3];
  std::vector<double> to_last_[2][3], to_next_[2][3];  // α/m of this rank's points of centres and faces; 0 without a neighbour
  Field before_;
};

}  // namespace bedflow
