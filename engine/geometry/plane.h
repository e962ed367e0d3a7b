// Planes that bound the particles: the faces of the box.
#pragma once

#include <array>

#include "base/vec3.h"

namespace bedflow {

struct Plane {
  Vec3 normal;        // unit, into the box
  double offset = 0;  // m, so that points of the plane have normal·x = offset

  double distance(Vec3 x) const { return dot(normal, x) - offset; }  // m, negative beyond the plane
};

// Faces of the box from the origin to `size` (m), as 2·direction + side.
inline std::array<Plane, 6> box_faces(Vec3 size) {
  std::array<Plane, 6> faces;
  for (int d = 0; d < 3; ++d) {
    faces[2 * d].normal[d] = 1;
    faces[2 * d + 1].normal[d] = -1;
    faces[2 * d + 1].offset = -size[d];
  }
  return faces;
}

}  // namespace bedflow
