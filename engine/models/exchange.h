// When gas and particles see each other within a gas step dt of n sub-steps.
//
// The gas is advanced before the particles, so it must know what they will receive. A particle whose drag coefficient b, gas
// velocity U and pressure gradient stay, and which touches nothing, feels on average over the step
//   F = ψ [b (U − V) − 𝒱∇p] − (1 − ψ) m g,     ψ = (1 − E)/x,   x = b dt/m,
// V being its velocity at the start and E what is left of U − V at the end. That is what the gas loses, with U and p at its end;
// what a particle receives beyond it (contacts, a b or U that changes under way) the gas loses in the next step. ψ takes its
// values between 1, frozen forces, and 0, a particle that goes with the gas, whose weight the gas carries.
#pragma once

#include <cmath>
#include <variant>

namespace bedflow {

// b, U − V, ∇p from the start of the step, frozen: E = 1 − x, so V overshoots U for x > 2.
struct Explicit {
  static constexpr const char* name = "explicit";
  static constexpr bool relaxes = false, anew = false;
  static double felt(double /*x*/, int /*substeps*/) { return 1; }
  // Mean of the force over a sub-step of z = b dt_sub/m over that at its start.
  static double felt_in_substep(double /*z*/) { return 1; }
  // The time (s) that must not exceed 2m/b.
  static double limited(double step, double /*substep*/) { return step; }
};

// b, U − V and ∇p taken anew in each sub-step at the particle's new place, the gas frozen: E = (1 − x/n)^n.
struct SubStepped {
  static constexpr const char* name = "sub_stepped";
  static constexpr bool relaxes = true, anew = true;
  static double felt(double x, int substeps) {
    const double z = x / substeps;
    if (z < 0.5) return x > 0 ? -std::expm1(substeps * std::log1p(-z)) / x : 1;
    return (1 - std::pow(1 - z, substeps)) / x;
  }
  static double felt_in_substep(double /*z*/) { return 1; }
  static double limited(double /*step*/, double substep) { return substep; }
};

// b, U and ∇p frozen, V relaxed towards U in each sub-step, exactly: E = e^−x. Stable for any x.
struct SemiImplicit {
  static constexpr const char* name = "semi_implicit";
  static constexpr bool relaxes = true, anew = false;
  static double felt(double x, int /*substeps*/) { return felt_in_substep(x); }
  static double felt_in_substep(double z) { return z > 0 ? -std::expm1(-z) / z : 1; }
  static double limited(double /*step*/, double /*substep*/) { return 0; }
};

using ExchangeScheme = std::variant<Explicit, SubStepped, SemiImplicit>;

}  // namespace bedflow
