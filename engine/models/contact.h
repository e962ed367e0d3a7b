// Normal contact laws: the force along n on the first of two bodies, from overlap and approach speed. Each holds for one contact
// (Real a double) or for a pack of them.
#pragma once

#include <cmath>
#include <numbers>

#include "base/vec3.h"

namespace bedflow {

// What a law needs to know of two bodies that touch; of a wall, m* and R* are the particle's own.
template <class Real>
struct Touching {
  Real overlap;   // δ > 0, m
  Real approach;  // v_n = (Vi − Vj)·n, n from i to j, m/s
  Real mass;      // m* = mi mj/(mi + mj), kg
  Real radius;    // R* = Ri Rj/(Ri + Rj), m
};

// Share of critical damping with which a linear oscillator rebounds with e after its half period:  |ln e|/√(π² + ln² e).
inline double damping_share(double restitution) {
  const double log_e = std::log(restitution);
  return std::abs(log_e) / std::sqrt(std::numbers::pi * std::numbers::pi + log_e * log_e);
}

// Linear spring–dashpot (Cundall & Strack 1979):  F_n = −(k δ + η v_n) n,  η = 2 β √(m* k),  β = |ln e|/√(π² + ln² e).
// Not clipped to repulsion: the restitution e follows the half period only without the clip.
struct LinearSpringDashpot {
  static constexpr const char* name = "linear_spring_dashpot";
  double stiffness = 0;      // k, N/m
  double damping_share = 0;  // β

  // Size of the force along −n (repulsive when positive), N.
  template <class Real>
  Real operator()(const Touching<Real>& c) const {
    return stiffness * c.overlap + damping(c.mass) * c.approach;
  }
  double energy(const Touching<double>& c) const { return 0.5 * stiffness * c.overlap * c.overlap; }  // of the spring, J
  template <class Real>
  Real damping(Real mass) const {  // η, kg/s
    return 2 * damping_share * sqrt(stiffness * mass);
  }

  static LinearSpringDashpot from_restitution(double stiffness, double restitution) {
    return {stiffness, bedflow::damping_share(restitution)};
  }
  // τ = π/√(k/m* − (η/2m*)²), s: of every impact.
  double collision_time(double mass) const {
    return std::numbers::pi / std::sqrt(stiffness / mass * (1 - damping_share * damping_share));
  }
};

// Hertz with the dashpot of Tsuji, Tanaka & Ishida (1992), Powder Technology 71, 239:
//   F_n = −(4/3 E* √R* δ^(3/2) + 2 √(5/6) β √(S_n m*) v_n) n,  S_n = 2 E* √(R* δ);  β as above gives the restitution e at every
//   speed.
struct Hertz {
  static constexpr const char* name = "hertz";
  double modulus = 0;        // E*, 1/E* = (1 − νi²)/Ei + (1 − νj²)/Ej, Pa
  double damping_share = 0;  // β

  template <class Real>
  Real operator()(const Touching<Real>& c) const {
    const Real slope = 2 * modulus * sqrt(c.radius * c.overlap);  // S_n = dF/dδ of the elastic part
    return 2.0 / 3 * slope * c.overlap + 2 * std::sqrt(5.0 / 6) * damping_share * sqrt(slope * c.mass) * c.approach;
  }

  double energy(const Touching<double>& c) const {  // of the elastic part, J
    return 8.0 / 15 * modulus * std::sqrt(c.radius * c.overlap) * c.overlap * c.overlap;
  }

  static Hertz from_restitution(double modulus, double restitution) { return {modulus, bedflow::damping_share(restitution)}; }
  // Duration of an elastic impact at speed v (Hertz 1881):  τ = 2.8683 (m*²/(R* E*² v))^(1/5), s. With e < 1 it lasts longer.
  double collision_time(double mass, double radius, double speed) const {
    return 2.8683 * std::pow(mass * mass / (radius * modulus * modulus * speed), 0.2);
  }
};

}  // namespace bedflow
