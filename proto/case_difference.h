// In what two cases differ as models: domain, gas, particles, coupling and time; not in names, monitors, references or output.
#pragma once

#include <string>
#include <vector>

#include "bedflow/v1/case.pb.h"

namespace bedflow {

struct CaseDifference {
  std::string path;           // of a field, or of a choice, as in "coupling.kernel"
  std::string first, second;  // what each case has there, in a case file's words; "none" where it has nothing
};

// Values that are left out count as their defaults.
std::vector<CaseDifference> differences(const v1::Case& first, const v1::Case& second);

}  // namespace bedflow
