#include "geometry/surface.h"

namespace bedflow {

namespace {

constexpr double aligned = 1e-12;  // round-off of unit vectors and of places against a metre

bool parallel(Vec3 a, Vec3 b) {
  return norm(cross(a, b)) <= aligned;
}

bool slides(const Revolved& surface, const Rotation& motion) {
  return parallel(surface.axis(), motion.axis) && norm(cross(motion.axis, surface.origin() - motion.point)) <= aligned;
}
bool slides(const Plane& surface, const Rotation& motion) {
  return parallel(surface.normal, motion.axis);
}
bool slides(const Plane& surface, const Translation& motion) {
  return std::abs(dot(surface.normal, motion.velocity)) <= aligned * norm(motion.velocity);
}
template <class Any, class Kind>
bool slides(const Any&, const Kind&) {
  return std::is_same_v<Kind, Still>;
}

}  // namespace

bool slides_along_itself(const Surface& surface, const Motion& motion) {
  return std::visit([](const auto& shape, const auto& kind) { return slides(shape, kind); }, surface, motion);
}

}  // namespace bedflow
