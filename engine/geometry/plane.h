// Planes that bound the particles: the faces of the box, and half-spaces of any direction.
#pragma once

#include <array>
#include <limits>

#include "geometry/touch.h"

namespace bedflow {

struct Plane {
  Vec3 normal;        // unit, to the side of the particles
  double offset = 0;  // m, so that points of the plane have normal·x = offset

  double distance(Vec3 x) const { return dot(normal, x) - offset; }  // m, negative beyond the plane

  void touch(Vec3 x, double reach, Touches& touches) const {
    const double away = distance(x);
    if (away < reach) touches.add({x - away * normal, normal, away});
  }
  bool passed(Vec3 x) const { return distance(x) < 0; }
  Bounds bounds() const {
    constexpr double far = std::numeric_limits<double>::infinity();
    return {{-far, -far, -far}, {far, far, far}};
  }
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
