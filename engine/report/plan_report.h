// The plan as the service's message.
#pragma once

#include <string>

#include "plan.h"

namespace bedflow {

// PlanReport in protobuf text format.
std::string plan_report(const Plan& plan);

}  // namespace bedflow
