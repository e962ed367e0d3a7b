// What a planned run will need: wall time, memory, bytes of a checkpoint.
#pragma once

#include "plan.h"

namespace bedflow {

// Into the plan's estimates, from what it has decided and counted.
void plan_cost(Plan& plan);

}  // namespace bedflow
