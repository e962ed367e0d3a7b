// Normal contact laws: the force along n on the first of two bodies, from overlap and approach speed.
#pragma once

#include <cmath>
#include <numbers>

namespace bedflow {

// Linear spring–dashpot (Cundall & Strack 1979):  F_n = −(k δ + η v_n) n,  v_n = (Vi − Vj)·n, n from i to j.
// Not clipped to repulsion: the restitution e follows the half period only without the clip.
struct LinearSpringDashpot {
  static constexpr const char* name = "linear_spring_dashpot";
  double stiffness = 0;  // k, N/m
  double damping = 0;    // η, kg/s

  // Size of the force along −n (repulsive when positive), N. overlap δ > 0 in m, approach v_n in m/s.
  double operator()(double overlap, double approach) const { return stiffness * overlap + damping * approach; }

  // η = 2 √(m* k) |ln e|/√(π² + ln² e): the half period of the damped oscillator then rebounds with e.
  static LinearSpringDashpot from_restitution(double stiffness, double restitution, double effective_mass) {
    const double log_e = std::log(restitution);
    return {stiffness, 2 * std::sqrt(effective_mass * stiffness) * std::abs(log_e) /
                           std::sqrt(std::numbers::pi * std::numbers::pi + log_e * log_e)};
  }
  // τ = π/√(k/m* − (η/2m*)²), s.
  double collision_time(double effective_mass) const {
    const double half_rate = damping / (2 * effective_mass);
    return std::numbers::pi / std::sqrt(stiffness / effective_mass - half_rate * half_rate);
  }
};

}  // namespace bedflow
