#include "geometry/motion.h"

#include <cmath>
#include <numbers>

namespace bedflow {

Pose Translation::pose(double time) const {
  Pose pose;
  pose.shift = time * velocity;
  pose.velocity = velocity;
  return pose;
}

// Rodrigues:  Q = cos α 1 + sin α [e]× + (1 − cos α) e eᵀ,  s = c − Q c.
Pose Rotation::pose(double time) const {
  Pose pose;
  const double angle = rate * time, cosine = std::cos(angle), sine = std::sin(angle);
  for (int row = 0; row < 3; ++row) {
    Vec3 unit;
    unit[row] = 1;
    pose.turn[row] = cosine * unit + sine * cross(unit, axis) + ((1 - cosine) * axis[row]) * axis;
  }
  pose.shift = point - pose.turned(point);
  pose.spin = rate * axis;
  pose.pivot = point;
  return pose;
}

Pose Vibration::pose(double time) const {
  const double rate = 2 * std::numbers::pi * frequency, angle = rate * time + phase;
  Pose pose;
  pose.shift = std::sin(angle) * amplitude;
  pose.velocity = rate * std::cos(angle) * amplitude;
  return pose;
}

Pose Course::pose(double time) const {
  Pose pose;
  const auto next = std::upper_bound(knots.begin(), knots.end(), time, [](double t, const Knot& knot) { return t < knot.time; });
  if (next == knots.begin()) {
    pose.shift = next->displacement;
  } else if (next == knots.end()) {
    pose.shift = knots.back().displacement;
  } else {
    const Knot& knot = *(next - 1);
    pose.velocity = 1 / (next->time - knot.time) * (next->displacement - knot.displacement);
    pose.shift = knot.displacement + (time - knot.time) * pose.velocity;
  }
  return pose;
}

namespace {

double farthest(const Still&, double, double, const Bounds&) {
  return 0;
}

// Of the corner that is farthest from the axis.
double radius_of(const Rotation& rotation, const Bounds& bounds) {
  double radius = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 place;
    for (int d = 0; d < 3; ++d) place[d] = (corner >> d & 1) != 0 ? bounds.high[d] : bounds.low[d];
    radius = std::max(radius, norm(cross(rotation.axis, place - rotation.point)));
  }
  return radius;
}

double farthest(const Rotation& rotation, double from, double to, const Bounds& bounds) {  // a chord of its circle
  return 2 * radius_of(rotation, bounds) * std::abs(std::sin(0.5 * rotation.rate * (to - from)));
}

template <class Shift>
double farthest(const Shift& motion, double from, double to, const Bounds&) {
  return norm(motion.pose(to).shift - motion.pose(from).shift);
}

double fastest(const Still&, const Bounds&) {
  return 0;
}
double fastest(const Translation& motion, const Bounds&) {
  return norm(motion.velocity);
}
double fastest(const Rotation& motion, const Bounds& bounds) {
  return std::abs(motion.rate) * radius_of(motion, bounds);
}
double fastest(const Vibration& motion, const Bounds&) {
  return 2 * std::numbers::pi * motion.frequency * norm(motion.amplitude);
}
double fastest(const Course& motion, const Bounds&) {
  double speed = 0;
  for (const Course::Knot& knot : motion.knots) speed = std::max(speed, norm(motion.pose(knot.time).velocity));
  return speed;
}

}  // namespace

double farthest_move(const Motion& motion, double from, double to, const Bounds& bounds) {
  return std::visit([&](const auto& kind) { return farthest(kind, from, to, bounds); }, motion);
}

double fastest_speed(const Motion& motion, const Bounds& bounds) {
  return std::visit([&](const auto& kind) { return fastest(kind, bounds); }, motion);
}

}  // namespace bedflow
