// A box with edges along the axes: a vessel that holds spheres inside it, or a solid block.
#pragma once

#include "geometry/touch.h"

namespace bedflow {

struct Box {
  Vec3 low, high;  // corners, m
  Keep keep = Keep::either;

  bool inside(Vec3 x) const {
    bool result = true;
    for (int d = 0; d < 3; ++d) result = result && x[d] >= low[d] && x[d] <= high[d];
    return result;
  }

  // From inside every face within reach; from outside the nearest point of the block, on a face, an edge or a corner.
  void touch(Vec3 x, double reach, Touches& touches) const {
    if (inside(x)) {
      for (int d = 0; d < 3; ++d)
        for (const double face : {low[d], high[d]}) {
          const double away = face == low[d] ? x[d] - face : face - x[d];
          if (away >= reach) continue;
          Touch touch{x, {}, away};
          touch.point[d] = face;
          touch.normal[d] = face == low[d] ? 1 : -1;
          touches.add(touch);
        }
      return;
    }
    Vec3 point;
    for (int d = 0; d < 3; ++d) point[d] = std::clamp(x[d], low[d], high[d]);
    const Vec3 way = x - point;
    const double away = norm(way);
    if (away < reach) touches.add({point, 1 / away * way, away});
  }
  bool passed(Vec3 x) const { return (keep == Keep::inside && !inside(x)) || (keep == Keep::outside && inside(x)); }
  Bounds bounds() const { return {low, high}; }
};

}  // namespace bedflow
