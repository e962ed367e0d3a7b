// Resistance to rolling: the torque (N m) on the first of two bodies against their relative rotation in the tangent plane. Each
// holds for one contact (Real a double) or for a pack of them. Review and comparison: Ai, Chen, Rotter & Ooi (2011), Powder
// Technology 206, 269.
#pragma once

#include <variant>

#include "base/vec3.h"
#include "models/tangential.h"

namespace bedflow {

// What every law needs to know of a contact.
template <class Real>
struct RollingContact {
  Vector3<Real> normal;  // n, from the first body to the second
  Vector3<Real> rate;    // ωi − ωj less its part along n, rad/s
  Real normal_force;     // |F_n|, N
  Real inertia;          // of the relative rotation: 1/I* = 1/Ii + 1/Ij; on a wall I of the particle, kg m²
  double dt = 0;         // sub-step, s
  Touching<Real> touching;
};

// None: no loop is run.
struct FreeRolling {
  static constexpr const char* name = "none";
  static constexpr bool history = false;
};

// Constant directional torque (Zhou, Wright, Yang, Xu & Yu 1999):  M = −μr R* |F_n| Δω/|Δω|.
// Capped, as Coulomb's force is, at what stops the rolling of this pair within the sub-step:  |M| ≤ I* |Δω|/dt.
struct ConstantRolling {
  static constexpr const char* name = "constant_rolling";
  static constexpr bool history = false;
  double friction = 0;  // μr

  template <class Real>
  Vector3<Real> operator()(const RollingContact<Real>& c) const {
    return -min(c.inertia / c.dt, friction * c.touching.radius * c.normal_force / norm(c.rate)) * c.rate;
  }
};

// Spring and dashpot with a limit (Iwashita & Oda 1998; Ai et al. 2011, model C):
//   M = −kr θ − ηr Δω,  |M| ≤ μr R* |F_n|,  θ = ∫ Δω dt, turned with n and set back where it slips,
//   kr = 2.25 kn (μr R*)²,  ηr = 2 βr √(I* kr).
struct SpringRolling {
  static constexpr const char* name = "spring_rolling";
  static constexpr bool history = true;
  double friction = 0;          // μr
  double normal_stiffness = 0;  // kn, N/m
  double damping_share = 0;     // βr, of critical damping

  template <class Real>
  Vector3<Real> operator()(const RollingContact<Real>& c, Vector3<Real>& angle) const {
    const Real arm = friction * c.touching.radius;
    const Real stiffness = 2.25 * normal_stiffness * arm * arm;
    angle = turned(angle, c.normal);
    return stick_or_slip(angle, c.rate, c.dt, stiffness, 2 * damping_share * sqrt(c.inertia * stiffness), arm * c.normal_force);
  }
  double energy(const Touching<double>& c, Vec3 angle) const {  // of the spring, J
    const double arm = friction * c.radius;
    return 0.5 * 2.25 * normal_stiffness * arm * arm * dot(angle, angle);
  }
};

using Rolling = std::variant<FreeRolling, ConstantRolling, SpringRolling>;

}  // namespace bedflow
