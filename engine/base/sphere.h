// Volume, m³, and moment of inertia, kg m², of a solid sphere.
#pragma once

#include <numbers>

namespace bedflow {

inline double sphere_volume(double diameter) {
  return std::numbers::pi / 6 * diameter * diameter * diameter;
}
inline double inertia_of(double mass, double radius) {
  return 0.4 * mass * radius * radius;
}

}  // namespace bedflow
