// Motion of the owned particles over a sub-step.
//
// Symplectic Euler: V and ω with the forces at the old place, X with the new V (what the MFiX family of codes calls Euler).
// Velocity Verlet with forces that depend on the velocity: they are taken at a predicted V, and corrected by what they became,
//   Vₙ = V*ₙ + ½ (Cₙ − Cₙ₋₁) dt,   Xₙ₊₁ = Xₙ + Vₙ dt + ½ (Cₙ + G) dt²,   V*ₙ₊₁ = Vₙ + (Cₙ + G) dt
// with C the acceleration by contacts at (Xₙ, V*ₙ) and G that by gravity and gas, constant in a gas step, whose impulse is then
// exactly G dt. Second order also with dashpots. A particle carries V*.
//
// A relaxed force of the gas, G − b V, takes V towards where it balances all other forces, exactly so for constant b and G:
//   V' = V + (1 − e^−z)/z dt A,   z = b dt/m,   A the acceleration at the start;   the gas gives
//   m (V' − V) − dt (contacts + m g).
// It goes with symplectic Euler.
#pragma once

#include <vector>

#include "particles/store.h"

namespace bedflow {

struct Moved {
  bool far = false;  // a particle is further than the limit (m) from its place, or not a number
  double work = 0;   // that the contacts have done on the particles: Σ force · mean velocity · dt, torques too, J
};

namespace rows {

constexpr Pack<8> spread(double position, double velocity, double spin) {
  return Pack<8>{position, position, position, velocity, velocity, velocity, spin, spin};
}
// The velocity of a row, where its position stands.
inline Pack<8> velocity_at_position(Pack<8> row) {
  return __builtin_shufflevector(row, row, 3, 4, 5, -1, -1, -1, -1, -1);
}

}  // namespace rows

// Advances the particles [first, last), all of one type, by dt (s) and sets their forces back to 0. place: of the last rebuild,
// and one more.
template <GasForce gas, bool rotation, bool verlet, bool distributed>
Moved integrate(const DemSetup& setup, const ParticleType type, std::size_t first, std::size_t last, ParticleStore& particles,
                ForceRow* const force, const Vec3* const place, double limit, double dt) {
  ParticleRow* const row = particles.rows.data();
  double* const spin_z = particles.spin_z.data();
  const double* const radius = particles.radius.data();
  const Vec3* const gas_force = particles.gas_force.data();
  GasResponse* const gas_response = particles.gas_response.data();
  ForceRow* const previous = particles.previous.data();
  double per_mass = dt / type.mass(), per_inertia = dt / inertia_of(type.mass(), type.radius);
  const Vec3 fall = dt * setup.gravity;
  const Pack<8> falls{0, 0, 0, fall.x, fall.y, fall.z, 0, 0}, drift = rows::spread(dt, 0, 0);
  auto far = Pack<4>{} != 0;
  Pack<8> power{};  // in the lanes of the velocity and the spin
  double power_z = 0;
  for (std::size_t i = first; i < last; ++i) {
    if constexpr (distributed) {
      const double mass = type.mass_of(radius[i]);
      per_mass = dt / mass, per_inertia = dt / inertia_of(mass, radius[i]);
    }
    const Pack<8> scale = rows::spread(0, per_mass, per_inertia), contact = load<8>(&force[i].torque_z);
    Pack<8> state = load<8>(&row[i].position.x), kick = scale * contact + falls;
    double turn = force[i].torque_z;
    if constexpr (gas == GasForce::frozen) {
      const Vec3 push = per_mass * gas_force[i];
      kick += Pack<8>{0, 0, 0, push.x, push.y, push.z, 0, 0};
    }
    if constexpr (gas == GasForce::relaxed) {
      GasResponse& response = gas_response[i];
      const Vec3 total = force[i].force + gas_force[i] - response.drag * row[i].velocity;
      const Vec3 change = response.share * (per_mass * total + fall);
      response.debt += dt / per_mass * (change - fall) - dt * force[i].force;
      kick = rows::spread(0, 0, per_inertia) * contact + Pack<8>{0, 0, 0, change.x, change.y, change.z, 0, 0};
    }
    if constexpr (verlet && gas != GasForce::relaxed) {
      ForceRow& before = previous[i];
      if (before.known != 0) {  // 0: the particle is new
        state += 0.5 * scale * (contact - load<8>(&before.torque_z));
        turn += 0.5 * (force[i].torque_z - before.torque_z);
      }
      before = force[i];
      before.known = 1;
      power += contact * (state + 0.5 * kick);
      state += drift * rows::velocity_at_position(state + 0.5 * kick) + kick;
    } else {
      power += contact * (state + 0.5 * kick);
      state += kick;
      state += drift * rows::velocity_at_position(state);
    }
    store(&row[i].position.x, state);
    if constexpr (rotation) {
      power_z += force[i].torque_z * (spin_z[i] + 0.5 * per_inertia * turn);
      spin_z[i] += per_inertia * turn;
    }
    force[i] = {};
    const Pack<4> moved = __builtin_shufflevector(state, state, 0, 1, 2, 3) - load<4>(&place[i].x), square = moved * moved;
    const Pack<4> distance2 = square + __builtin_shufflevector(square, square, 1, 2, 0, 0) +
                              __builtin_shufflevector(square, square, 2, 0, 1, 0);  // in lane 0
    far |= !(distance2 <= limit * limit);
  }
  return {(bits_of(far) & 1) != 0, dt * (power[3] + power[4] + power[5] + power[6] + power[7] + power_z)};
}

}  // namespace bedflow
