// Kernels: how a particle is spread over a lattice of the grid, one direction at a time.
#pragma once

#include <algorithm>
#include <cmath>

namespace bedflow {

// Two neighbouring lattice points and their shares.
struct Stencil {
  int index[2];
  double weight[2];
};

// Trilinear hat, as wide as the cells (Snider, O'Rourke & Andrews 1998): with s the place in lattice units and i = ⌊s⌋,
//   w(i) = 1 − (s − i),  w(i+1) = s − i.
// Shares beyond [lowest, highest] fold onto the nearest point: the weights always sum to 1.
struct Hat {
  static constexpr const char* name = "hat";
  static Stencil along(double s, int lowest, int highest) {
    const double below = std::floor(s);
    const int i = static_cast<int>(below);
    const double upper = s - below;
    return {{std::clamp(i, lowest, highest), std::clamp(i + 1, lowest, highest)}, {1 - upper, upper}};
  }
};

}  // namespace bedflow
