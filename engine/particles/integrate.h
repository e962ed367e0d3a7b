// Symplectic Euler: V and ω with the forces at the old place, X with the new V (what the MFiX family of codes calls Euler).
#pragma once

#include <vector>

#include "particles/store.h"

namespace bedflow {

// A relaxed force of the gas, G − b V, takes V towards where it balances all other forces, exactly so for constant b and G:
//   V' = V + (1 − e^−z)/z dt A,   z = b dt/m,   A the acceleration at the start;   the gas gives m (V' − V) − dt (contacts + m
//   g).
//
// Advances the owned particles by dt (s) and sets force and torque back to 0. place: of the last rebuild. Returns whether one is
// further than `limit` (m) from its place, or not a number.
template <bool rotation, GasForce gas>
bool integrate(const DemSetup& setup, ParticleStore& particles, std::vector<Vec3>& force, std::vector<Vec3>& torque,
               const std::vector<Vec3>& place, double limit, double dt) {
  const double per_mass = dt / setup.mass, per_inertia = dt / setup.inertia(), limit2 = limit * limit;
  const Vec3 fall = dt * setup.gravity;
  bool far = false;
  for (std::size_t i = 0; i < particles.owned; ++i) {
    Vec3 total = force[i];
    if constexpr (gas != GasForce::none) total += particles.gas_force[i];
    if constexpr (gas == GasForce::relaxed) {
      GasResponse& response = particles.gas_response[i];
      const Vec3 change = response.share * (per_mass * (total - response.drag * particles.velocity(i)) + fall);
      response.debt += setup.mass * (change - fall) - dt * force[i];
      particles.velocity(i) += change;
    } else {
      particles.velocity(i) += per_mass * total + fall;
    }
    particles.position(i) += dt * particles.velocity(i);
    force[i] = {};
    if constexpr (rotation) {
      particles.set_spin(i, particles.spin(i) + per_inertia * torque[i]);
      torque[i] = {};
    }
    const Vec3 moved = particles.position(i) - place[i];
    far |= !(dot(moved, moved) <= limit2);
  }
  return far;
}

}  // namespace bedflow
