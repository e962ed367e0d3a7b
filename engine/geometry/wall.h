// A wall of the scene: a surface and how it moves.
#pragma once

#include <string>

#include "geometry/motion.h"
#include "geometry/surface.h"

namespace bedflow {

struct Wall {
  std::string name;
  Surface surface;  // at rest
  Motion motion;

  Pose pose(double time) const {
    return std::visit([&](const auto& kind) { return kind.pose(time); }, motion);
  }
};

}  // namespace bedflow
