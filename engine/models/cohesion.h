// Attraction between bodies near each other. Holds for one pair (Real a double) or for a pack of them.
#pragma once

#include <algorithm>
#include <variant>

#include "base/vec3.h"

namespace bedflow {

// None: no loop is run.
struct NoCohesion {
  static constexpr const char* name = "none";
};

// Van der Waals (Hamaker 1937, in Derjaguin's approximation; Israelachvili, Intermolecular and Surface Forces, table 13.1):
//   F = A R*/(6 s²)  for  s_min ≤ s ≤ s_max;  the value at s_min nearer than that and in contact, 0 beyond the cut-off.
struct VanDerWaals {
  static constexpr const char* name = "van_der_waals";
  double hamaker = 0;   // A, J
  double nearest = 0;   // s_min, m
  double furthest = 0;  // s_max, m

  // Size of the attraction, N. gap: s, negative in contact, m; radius: R*, m.
  template <class Real>
  Real operator()(Real gap, Real radius) const {
    const Real distance = max(gap, broadcast<Real>(nearest));
    return select(gap <= furthest, hamaker / 6 * radius / (distance * distance), Real{});
  }
  // The work of the force from here to beyond the cut-off, with the sign of a potential, J.
  double energy(double gap, double radius) const {
    if (gap > furthest) return 0;
    const double distance = std::max(gap, nearest), well = hamaker / 6 * radius;
    return well * ((gap - distance) / (distance * distance) + 1 / furthest - 1 / distance);
  }
};

using Cohesion = std::variant<NoCohesion, VanDerWaals>;

}  // namespace bedflow
