// Drag laws: the coefficient b (kg/s) of one particle in F = b (U − V), from the state of the gas around it.
//
//   law(scene, slip v = |U − V| in m/s, fraction ε at the particle)
//
// b is that of model A: the force of the mean pressure gradient, −𝒱∇p, is a force of its own. A law published otherwise says how
// it is converted. No law divides by v, so b is finite at rest.
#pragma once

#include <variant>

#include "models/drag/correlations.h"
#include "models/drag/simulations.h"

namespace bedflow {

// The same b for every particle: tests against closed forms.
struct ConstantDrag {
  static constexpr const char* name = "constant_drag";
  double coefficient = 0;  // kg/s
  double operator()(const DragScene&, double /*slip*/, double /*fraction*/) const { return coefficient; }
};

using Drag = std::variant<GidaspowBlended, Gidaspow, WenYu, Ergun, SchillerNaumann, DiFelice, SyamlalObrien, KochHill, Beetstra,
                          Tenneti, ConstantDrag>;

}  // namespace bedflow
