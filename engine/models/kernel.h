// Kernels: how a particle is spread over a lattice of the grid, one direction at a time.
//
// Each is a struct that writes the shares of `points` neighbouring lattice points and returns the first of them, s being the
// particle's place and `diameters` its diameter in lattice units. Point i stands for [i − ½, i + ½]. All shares are at least 0
// and sum to 1. points_for(diameters) says how many points are needed.
#pragma once

#include <algorithm>
#include <cmath>
#include <variant>

namespace bedflow {

// Trilinear hat, as wide as the cells (Snider, O'Rourke & Andrews 1998): with i = ⌊s⌋,
//   w(i) = 1 − (s − i),  w(i+1) = s − i.
struct Hat {
  static constexpr const char* name = "hat";
  static int points_for(double /*diameters*/) { return 2; }
  static int along(double s, double /*diameters*/, double* share, int /*points*/) {
    const double below = std::floor(s);
    share[1] = s - below;
    share[0] = 1 - share[1];
    return static_cast<int>(below);
  }
};

// Divided particle volume method: the part of a cube of edge `width` diameters around the particle that lies in the interval of
// the point. With `caps`, a direction at a time, the part of the ball of that diameter: beyond a face at distance a − h from the
// centre of a ball of radius a lies h² (3a − h)/(4a³).
struct SquareDpvm {
  static constexpr const char* name = "square_dpvm";
  double width = 1.5;  // diameters
  bool caps = false;

  int points_for(double diameters) const { return static_cast<int>(width * diameters) + 2; }
  int along(double s, double diameters, double* share, int points) const {
    const double half = 0.5 * width * diameters;
    const int first = static_cast<int>(std::floor(s - half + 0.5));
    double below = 0;
    for (int p = 0; p < points; ++p) {
      const double upper = part_below((first + p + 0.5 - s) / half);
      share[p] = upper - below;
      below = upper;
    }
    return first;
  }

 private:
  // Part of the body below t, which is −1 at its low end and 1 at its high end.
  double part_below(double t) const {
    const double h = 1 + std::clamp(t, -1.0, 1.0);
    return caps ? h * h * (3 - h) / 4 : h / 2;
  }
};

// Garg, Galvin, Li & Pannala (2012), Powder Technol. 220, 122: the hat on each lattice. What sets the scheme apart is that drag
// is taken anew in each sub-step, which is the exchange's affair.
struct Garg : Hat {
  static constexpr const char* name = "garg";
};

// A Gaussian of full width `width` diameters at half maximum, whatever the cells: the hat's shares, spread on by diffusion on the
// grid (Capecelatro & Desjardins 2013, J. Comput. Phys. 238, 1; Sun & Xiao 2015, Int. J. Multiphase Flow 77, 142).
//   σ = width d/(2 √(2 ln 2))
struct Gaussian : Hat {
  static constexpr const char* name = "gaussian";
  double width = 3;  // diameters
  double deviation(double diameter) const { return width * diameter / (2 * std::sqrt(2 * std::log(2.0))); }
};

using Kernel = std::variant<Hat, SquareDpvm, Garg, Gaussian>;

}  // namespace bedflow
