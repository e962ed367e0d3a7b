// A flat triangle of a wall, without thickness, touched from both sides.
#pragma once

#include <array>

#include "geometry/touch.h"

namespace bedflow {

using Triangle = std::array<Vec3, 3>;

struct Facet {
  Triangle corners;  // m
  Vec3 normal;       // unit

  static Facet of(const Triangle& t) {
    const Vec3 area = cross(t[1] - t[0], t[2] - t[0]);
    return {t, 1 / norm(area) * area};
  }

  // The nearest point and what belongs to it. Above the triangle itself distance and normal are the plane's, to round-off;
  // elsewhere those of the nearest point of an edge, where the triangle may also be a sliver.
  Touch nearest(Vec3 x) const {
    const double height = dot(x - corners[0], normal);
    bool above = true;
    for (int k = 0; k < 3 && above; ++k) above = dot(cross(normal, corners[(k + 1) % 3] - corners[k]), x - corners[k]) > 0;
    if (above) return {x - height * normal, height < 0 ? -normal : normal, std::abs(height)};
    Vec3 best;
    double best2 = -1;
    for (int k = 0; k < 3; ++k) {
      const Vec3 edge = corners[(k + 1) % 3] - corners[k], from = x - corners[k];
      const double length2 = dot(edge, edge);
      const Vec3 point = corners[k] + (length2 > 0 ? std::clamp(dot(from, edge) / length2, 0.0, 1.0) : 0) * edge;
      const Vec3 way = x - point;
      const double away2 = dot(way, way);
      if (best2 >= 0 && away2 >= best2) continue;
      best = point;
      best2 = away2;
    }
    const double away = std::sqrt(best2);
    return {best, away > 0 ? 1 / away * (x - best) : normal, away};
  }
};

}  // namespace bedflow
