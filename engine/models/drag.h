// Drag laws: the coefficient b (kg/s) of one particle in F = b (U − V), from the state of the gas around it.
//
//   slip   v = |U − V| in m/s          fraction   ε at the particle
//   Re = ρg ε d v/μ.  No law divides by v, so b is finite at rest.
#pragma once

#include <cmath>
#include <numbers>
#include <variant>

namespace bedflow {

// What every law needs to know of the gas and of a particle.
struct DragScene {
  double density = 0;    // ρg, kg/m³
  double viscosity = 0;  // μ, Pa·s
  double diameter = 0;   // d, m
};

// Wen & Yu (1966) with the factor ε^−1.65 on C_D; switched to Newton's range at Re = 1000.
//   Re ≤ 1000:  b = 3π μ d (1 + 0.15 Re^0.687) ε^−2.65        else:  b = ½·0.44 ρg v π r² ε^−1.65
struct WenYu {
  static constexpr const char* name = "wen_yu";
  double operator()(const DragScene& s, double slip, double fraction) const {
    const double reynolds = s.density * fraction * s.diameter * slip / s.viscosity;
    const double thinning = std::pow(fraction, -1.65);
    if (reynolds <= 1000) {
      return 3 * std::numbers::pi * s.viscosity * s.diameter * (1 + 0.15 * std::pow(reynolds, 0.687)) * thinning / fraction;
    }
    return 0.5 * 0.44 * s.density * slip * std::numbers::pi * 0.25 * s.diameter * s.diameter * thinning;
  }
};

// Ergun (1952), 150 and 1.75, per particle and for model A (−𝒱∇p is a force of its own):
//   b = 25π μ d (1−ε)/ε + (7π/24) ρg d² v
struct Ergun {
  static constexpr const char* name = "ergun";
  double operator()(const DragScene& s, double slip, double fraction) const {
    return 25 * std::numbers::pi * s.viscosity * s.diameter * (1 - fraction) / fraction +
           7 * std::numbers::pi / 24 * s.density * s.diameter * s.diameter * slip;
  }
};

// Gidaspow (1994), blended as by Lathouwers & Bellan (2001):
//   b = χ b_WenYu + (1−χ) b_Ergun,   χ = arctan(150·1.75 (ε − 0.8))/π + ½
struct GidaspowBlended {
  static constexpr const char* name = "gidaspow_blended";
  double operator()(const DragScene& s, double slip, double fraction) const {
    const double blend = std::atan(150 * 1.75 * (fraction - 0.8)) * std::numbers::inv_pi + 0.5;
    return blend * WenYu{}(s, slip, fraction) + (1 - blend) * Ergun{}(s, slip, fraction);
  }
};

// The same b for every particle: tests against closed forms.
struct ConstantDrag {
  static constexpr const char* name = "constant_drag";
  double coefficient = 0;  // kg/s
  double operator()(const DragScene&, double, double) const { return coefficient; }
};

using Drag = std::variant<GidaspowBlended, Ergun, WenYu, ConstantDrag>;

}  // namespace bedflow
