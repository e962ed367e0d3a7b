// The pairs that touch, by brute force over all.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>

#include "base/vec3.h"

namespace bedflow {

// spheres: by id, with a position (m). reach(a, b): distance (m) below which they touch. period: of all directions, m; 0: none.
template <class Sphere, class Reach>
std::int64_t touching_pairs(const std::map<std::int64_t, Sphere>& spheres, Reach reach, double period) {
  std::int64_t count = 0;
  for (auto i = spheres.begin(); i != spheres.end(); ++i)
    for (auto j = std::next(i); j != spheres.end(); ++j) {
      Vec3 apart = j->second.position - i->second.position;
      for (int d = 0; d < 3 && period > 0; ++d) apart[d] -= period * std::round(apart[d] / period);
      count += norm(apart) < reach(i->second, j->second);
    }
  return count;
}

}  // namespace bedflow
