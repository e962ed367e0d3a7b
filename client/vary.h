// What a study varies: an axis is a parameter, a choice of laws or a knob by name, and the values that it takes.
#pragma once

#include <string>
#include <vector>

#include "bedflow/v1/case.pb.h"

namespace bedflow::client {

struct Axis {
  std::string name;                 // as the user said it
  std::vector<std::string> values;  // in the user's order
};

// "particles.steps_per_collision=8,12,20". Throws Failure.
Axis parse_axis(const std::string& text);

// Gives the case one of the axis' values. The axis' name is a path of --set or one of the knobs; a path that ends in the name of
// a choice ("coupling.kernel", "gas.convection") takes the names of its laws, and numbers that both laws name alike are kept. A
// value "x0.5" multiplies what the case has, also each number of a block ("domain.cells=x0.5"). Throws Failure.
void vary(v1::Case& value, const std::string& axis, const std::string& setting);

// Index of the value that resolves most, for axes that are known to have one. Throws Failure for the others.
std::size_t finest(const Axis& axis);

struct Knob {
  std::string name, path, meaning;
};
std::vector<Knob> knobs();  // short names for what is varied most

}  // namespace bedflow::client
