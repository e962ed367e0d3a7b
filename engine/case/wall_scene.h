// The walls of a case.
#pragma once

#include <vector>

#include "bedflow/v1/case.pb.h"
#include "geometry/wall.h"

namespace bedflow {

std::vector<Wall> wall_scene(const v1::Case& from);

}  // namespace bedflow
