// Tangential contact laws: the force (N) on the first of two bodies in the tangent plane of their contact.
#pragma once

#include <algorithm>
#include <cmath>
#include <variant>

#include "base/vec3.h"
#include "models/contact.h"

namespace bedflow {

// What every law needs to know of a contact.
struct Sliding {
  Vec3 normal;              // n, from the first body to the second
  Vec3 velocity;            // Vt of the first body's surface relative to the second's, in the tangent plane, m/s
  double normal_force = 0;  // |F_n|, N
  double mass = 0;          // impulse over change of Vt, spins included, kg: 2/7 m* for solid spheres
  double dt = 0;            // sub-step, s
};

// No tangential force: the particles do not rotate.
struct Frictionless {
  static constexpr const char* name = "frictionless";
  static constexpr bool rotation = false, history = false;
};

// Sliding friction without memory (van der Hoef et al. 2006):  F_t = −μf |F_n| Vt/|Vt|.
// Undefined at Vt = 0 and flipping its sign every sub-step in a resting contact; so it is capped at what stops the sliding
// of this pair within the sub-step:  |F_t| ≤ m_t |Vt|/dt,  m_t = 2/7 m*.
struct Coulomb {
  static constexpr const char* name = "coulomb";
  static constexpr bool rotation = true, history = false;
  double friction = 0;  // μf

  Vec3 operator()(const Sliding& s) const {
    // std::min returns its first argument when the second is 0/0.
    return -std::min(s.mass / s.dt, friction * s.normal_force / norm(s.velocity)) * s.velocity;
  }
};

// Tangential spring with the contact's history (Cundall & Strack 1979):
//   ξ turned into the present tangent plane, ξ += Vt dt,  F_t = −kt ξ − ηt Vt;
//   beyond |F_t| = μf |F_n| it slips: F_t keeps its direction, and ξ becomes what gives this force.
// Turning: projection on the plane, then back to the length it had, so that a pair that rolls as a whole neither loses nor
// gains elastic energy (Luding 2008, Granular Matter 10, 235).
struct TangentialSpring {
  static constexpr const char* name = "spring";
  static constexpr bool rotation = true, history = true;
  double friction = 0;   // μf
  double stiffness = 0;  // kt, N/m
  double damping = 0;    // ηt, kg/s

  Vec3 operator()(const Sliding& s, Vec3& displacement) const {
    const Vec3 in_plane = displacement - dot(displacement, s.normal) * s.normal;
    const double length2 = dot(in_plane, in_plane);
    const double stretch = length2 > 0 ? std::sqrt(dot(displacement, displacement) / length2) : 0;
    displacement = stretch * in_plane + s.dt * s.velocity;
    const Vec3 trial = -stiffness * displacement - damping * s.velocity;
    const double limit = friction * s.normal_force, size = norm(trial);
    if (size <= limit) return trial;
    const Vec3 slipping = limit / size * trial;
    displacement = -(1 / stiffness) * (slipping + damping * s.velocity);
    return slipping;
  }

  // kt and ηt as shares of the normal law's k and η.
  static TangentialSpring from_normal(double friction, const LinearSpringDashpot& normal, double stiffness_ratio = 2.0 / 7,
                                      double damping_ratio = 0.5) {
    return {friction, stiffness_ratio * normal.stiffness, damping_ratio * normal.damping};
  }
};

using Tangential = std::variant<Frictionless, Coulomb, TangentialSpring>;

}  // namespace bedflow
