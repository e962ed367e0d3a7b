// Convection schemes: what a face's velocity has beyond that of the cell upstream, on a uniform grid.
//
//   behind  u_C − u_U,   ahead  u_D − u_C,   with U, C, D far upstream, upstream and downstream of the face
//   u_face = u_C + ½ ψ(r) ahead,             r = behind/ahead
//
// No scheme divides by `ahead`; each is odd (−behind, −ahead give −result), 0 at an extremum, and keeps u_face between u_C and
// u_D (Sweby 1984), so that it is bounded. Corrections to upwind are first order where ψ is cut, second where it is smooth.
#pragma once

#include <algorithm>
#include <cmath>
#include <variant>

namespace bedflow {

// ψ = 0.
struct Upwind {
  static constexpr const char* name = "upwind";
  static constexpr int ghosts = 1;  // layers of the grid
};

// Gaskell & Lau (1988), int. j. numer. meth. fluids 8, 617: QUICK between bounds.   ψ = max(0, min(4r, ¾ + ¼r, 2))
struct Smart {
  static constexpr const char* name = "smart";
  static constexpr int ghosts = 2;
  double operator()(double behind, double ahead) const {
    const double sign = std::copysign(0.5, ahead), b = std::abs(ahead), r = 2 * sign * behind;  // both over the sign of ahead
    return sign * std::max(0.0, std::min(std::min(4 * r, 0.75 * b + 0.25 * r), 2 * b));
  }
};

// Roe (1986), Annu. Rev. Fluid Mech. 18, 337: the steepest that is bounded.   ψ = max(0, min(2r, 1), min(r, 2))
struct Superbee {
  static constexpr const char* name = "superbee";
  static constexpr int ghosts = 2;
  double operator()(double behind, double ahead) const {
    const double sign = std::copysign(0.5, ahead), b = std::abs(ahead), r = 2 * sign * behind;
    return sign * std::max(0.0, std::max(std::min(2 * r, b), std::min(r, 2 * b)));
  }
};

using Convection = std::variant<Upwind, Smart, Superbee>;

inline int ghosts_of(const Convection& convection) {
  return std::visit([](auto scheme) { return scheme.ghosts; }, convection);
}

}  // namespace bedflow
