// How a wall moves: places and velocities in closed form of time, never added up, so that a resume has the same bits.
//
// A body of the wall stands at X at rest; at time t it is at x = Q(t) X + s(t), and its material moves with
// V(x) = v(t) + Ω × (x − c).
#pragma once

#include <array>
#include <variant>
#include <vector>

#include "geometry/touch.h"

namespace bedflow {

struct Pose {
  std::array<Vec3, 3> turn{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // rows of Q
  Vec3 shift;                                                   // s, m
  Vec3 velocity;                                                // v, m/s
  Vec3 spin;                                                    // Ω, rad/s
  Vec3 pivot;                                                   // c, m

  Vec3 turned(Vec3 direction) const { return {dot(turn[0], direction), dot(turn[1], direction), dot(turn[2], direction)}; }
  Vec3 turned_back(Vec3 direction) const { return direction.x * turn[0] + direction.y * turn[1] + direction.z * turn[2]; }
  Vec3 to_world(Vec3 body) const { return turned(body) + shift; }
  Vec3 to_body(Vec3 world) const { return turned_back(world - shift); }
  Vec3 velocity_at(Vec3 world) const { return velocity + cross(spin, world - pivot); }
};

struct Still {
  Pose pose(double /*time*/) const { return {}; }
};

struct Translation {
  Vec3 velocity;  // m/s

  Pose pose(double time) const;
};

struct Rotation {
  Vec3 point;       // of the axis, m
  Vec3 axis;        // unit; counterclockwise seen from its tip
  double rate = 0;  // rad/s

  Pose pose(double time) const;
};

// s = a sin(2πft + ψ)
struct Vibration {
  Vec3 amplitude;        // a, m
  double frequency = 0;  // f, 1/s
  double phase = 0;      // ψ, rad

  Pose pose(double time) const;
};

// A displacement for each of some times, linear between them and constant before the first and after the last.
struct Course {
  struct Knot {
    double time = 0;    // s, increasing
    Vec3 displacement;  // m
  };
  std::vector<Knot> knots;

  Pose pose(double time) const;  // at a knot the velocity is that of the line behind it
};

using Motion = std::variant<Still, Translation, Rotation, Vibration, Course>;

// No point of the wall that lies within `bounds` can have moved further from one time to another, m.
double farthest_move(const Motion& motion, double from, double to, const Bounds& bounds);
// No such point is ever faster, m/s.
double fastest_speed(const Motion& motion, const Bounds& bounds);

}  // namespace bedflow
