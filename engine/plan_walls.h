// What a plan says of the walls within the box, and which it refuses.
#pragma once

#include <string>
#include <vector>

#include "geometry/wall.h"
#include "scene.h"

namespace bedflow {

// "drum (rotating), chute (triangles)".
std::string walls_text(const std::vector<Wall>& walls);

// Throws Stop(invalid_case), naming wall and field, where a wall is beyond the box, lies on one of its faces (whom particles
// would touch twice), ends at a periodic face, or moves too far in a sub-step (s). skin: of the pair list, m.
void check_walls(const Scene& scene, double skin, double substep);

}  // namespace bedflow
