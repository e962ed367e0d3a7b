// A vector of the case as the engine has it.
#pragma once

#include "base/vec3.h"
#include "bedflow/v1/case.pb.h"

namespace bedflow {

inline Vec3 vec(const v1::Vector& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace bedflow
