// What every drag law needs to know of the gas and of a particle.
#pragma once

#include <numbers>

namespace bedflow {

struct DragScene {
  double density = 0;    // ρg, kg/m³
  double viscosity = 0;  // μ, Pa·s
  double diameter = 0;   // d, m

  // 3π μ d: b of a slow sphere in clear gas (Stokes 1851), kg/s.
  double stokes() const { return 3 * std::numbers::pi * viscosity * diameter; }
  // ρg d v/μ, with v the slip or, for most laws, ε times it.
  double reynolds(double v) const { return density * diameter * v / viscosity; }
};

}  // namespace bedflow
