// The generic check of a case by the options of its schema: it knows no field by name.
#pragma once

#include <vector>

#include "case_file.h"

namespace bedflow {

// Required, bounds, NaN and infinity, patterns, numbers of items, choices, fields this build does not know.
// Bounds on a field of type Vector hold for each component.
std::vector<CaseFault> walk_case(const v1::Case& value);

}  // namespace bedflow
