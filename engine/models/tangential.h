// Tangential contact laws: the force (N) on the first of two bodies in the tangent plane of their contact. Each holds for one
// contact (Real a double) or for a pack of them.
#pragma once

#include <variant>

#include "base/vec3.h"
#include "models/contact.h"

namespace bedflow {

// What every law needs to know of a contact.
template <class Real>
struct Sliding {
  Vector3<Real> normal;    // n, from the first body to the second
  Vector3<Real> velocity;  // Vt of the first body's surface relative to the second's, in the tangent plane, m/s
  Real normal_force;       // |F_n|, N
  Real mass;               // impulse over change of Vt, spins included, kg: 2/7 m* for solid spheres
  double dt = 0;           // sub-step, s
  Touching<Real> touching;
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

  template <class Real>
  Vector3<Real> operator()(const Sliding<Real>& s) const {
    return -min(s.mass / s.dt, friction * s.normal_force / norm(s.velocity)) * s.velocity;  // the first when the second is 0/0
  }
};

// ξ turned into the plane normal to n: projection, then back to the length it had, so that a pair that rolls as a whole neither
// loses nor gains elastic energy (Luding 2008, Granular Matter 10, 235).
template <class Real>
Vector3<Real> turned(Vector3<Real> displacement, Vector3<Real> normal) {
  const Vector3<Real> in_plane = displacement - dot(displacement, normal) * normal;
  const Real length2 = dot(in_plane, in_plane);
  const Real stretch = sqrt(dot(displacement, displacement) / length2);
  return select(length2 > 0, stretch, Real{}) * in_plane;
}

// A spring with memory, a dashpot and a limit (Cundall & Strack 1979):  ξ += rate dt,  trial = −k ξ − η rate;  beyond the limit
// it slips: the trial keeps its direction, and ξ becomes what gives this force.
template <class Real>
Vector3<Real> stick_or_slip(Vector3<Real>& displacement, Vector3<Real> rate, double dt, Real stiffness, Real damping,
                            Real limit) {
  displacement += dt * rate;
  const Vector3<Real> trial = -stiffness * displacement - damping * rate;
  const Real size = norm(trial);
  const auto sticks = size <= limit;
  const Vector3<Real> slipping = limit / size * trial;
  const Real softness = -1 / stiffness;
  Vector3<Real> force;
  for (int d = 0; d < 3; ++d) {
    force[d] = select(sticks, trial[d], slipping[d]);
    displacement[d] = select(sticks, displacement[d], softness * (slipping[d] + damping * rate[d]));
  }
  return force;
}

// Tangential spring with the contact's history (Cundall & Strack 1979):  F_t = −kt ξ − ηt Vt,  |F_t| ≤ μf |F_n|,  ξ turned with
// n. kt and ηt are shares of the normal law's k and η.
struct TangentialSpring {
  static constexpr const char* name = "spring";
  static constexpr bool rotation = true, history = true;
  double friction = 0;         // μf
  double stiffness = 0;        // kt, N/m
  double damping_ratio = 0.5;  // ηt/η
  LinearSpringDashpot normal;  // whose η that is

  template <class Real>
  Vector3<Real> operator()(const Sliding<Real>& s, Vector3<Real>& displacement) const {
    displacement = turned(displacement, s.normal);
    return stick_or_slip(displacement, s.velocity, s.dt, broadcast<Real>(stiffness),
                         damping_ratio * normal.damping(s.touching.mass), friction * s.normal_force);
  }

  double energy(const Touching<double>& /*c*/, Vec3 displacement) const {  // of the spring, J
    return 0.5 * stiffness * dot(displacement, displacement);
  }

  static TangentialSpring from_normal(double friction, const LinearSpringDashpot& normal, double stiffness_ratio = 2.0 / 7,
                                      double damping_ratio = 0.5) {
    return {friction, stiffness_ratio * normal.stiffness, damping_ratio, normal};
  }
};

// Mindlin's tangential stiffness S_t for Hertz's contact:
//   F_t = −2/3 S_t ξ − 2 √(5/6) β √(S_t m*) Vt,  S_t = 8 G* √(R* δ),  |F_t| ≤ μf |F_n|,  ξ turned with n.
// S_t is the slope dF_t/dξ, which grows with the contact's radius; 2/3 is the mean slope over an impact's ξ (Di Renzo & Di Maio
// 2005, Chem. Eng. Sci. 60, 1303). Dashpot: Tsuji, Tanaka & Ishida (1992).
struct Mindlin {
  static constexpr const char* name = "mindlin";
  static constexpr bool rotation = true, history = true;
  double friction = 0;       // μf
  double modulus = 0;        // G*, 1/G* = (2 − νi)/Gi + (2 − νj)/Gj,  G = E/(2(1 + ν)), Pa
  double damping_share = 0;  // β of the normal law

  template <class Real>
  Vector3<Real> operator()(const Sliding<Real>& s, Vector3<Real>& displacement) const {
    displacement = turned(displacement, s.normal);
    const Real slope = 8 * modulus * sqrt(s.touching.radius * s.touching.overlap);
    const Real damping = 2 * std::sqrt(5.0 / 6) * damping_share * sqrt(slope * s.touching.mass);
    return stick_or_slip<Real>(displacement, s.velocity, s.dt, 2.0 / 3 * slope, damping, friction * s.normal_force);
  }
  double energy(const Touching<double>& c, Vec3 displacement) const {  // of the spring, J
    return 8.0 / 3 * modulus * std::sqrt(c.radius * c.overlap) * dot(displacement, displacement);
  }
};

using Tangential = std::variant<Frictionless, Coulomb, TangentialSpring, Mindlin>;

}  // namespace bedflow
