// What a wall can be. Each surface says which points a sphere touches and who has passed it; chosen once, above the loop.
#pragma once

#include <variant>

#include "geometry/box.h"
#include "geometry/mesh.h"
#include "geometry/motion.h"
#include "geometry/plane.h"
#include "geometry/revolved.h"

namespace bedflow {

using Surface = std::variant<Plane, Box, Revolved, Mesh>;

// Whether the motion carries the surface along itself: a drum about its own axis, a belt. Its material moves, its place does not.
bool slides_along_itself(const Surface& surface, const Motion& motion);

}  // namespace bedflow
