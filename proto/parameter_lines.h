// The parameters of a case as data: what parameter_reference() prints for people.
#pragma once

#include <string>
#include <vector>

namespace bedflow {

struct ParameterLine {
  std::string block, field, type, unit, otherwise, allowed, meaning;  // otherwise: the default, or "required"
};
std::vector<ParameterLine> parameter_lines();

}  // namespace bedflow
