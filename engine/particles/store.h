// What a rank keeps of its particles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vec3.h"

namespace bedflow {

// What a contact needs of a particle: 64 bytes, one cache line, one vector register. The third component of the spin stands
// apart.
struct alignas(64) ParticleRow {
  Vec3 position;                  // m
  Vec3 velocity;                  // m/s
  double spin_x = 0, spin_y = 0;  // ω, rad/s
};

// How the force of the gas follows a particle's velocity within a gas step, and what the gas has not lost yet.
struct GasResponse {
  double drag = 0;   // b, kg/s: the force is gas_force − b V
  double share = 1;  // mean of that force over a sub-step over the force at its start: (1 − e^−z)/z, z = b dt/m
  Vec3 debt;         // N·s received so far less what the gas loses for it
};

enum class GasForce { none, frozen, relaxed };  // over the sub-steps of a gas step

// Sorted in space; owned particles first, then ghosts (copies of what other ranks, or other periodic images, own). A ghost across
// a periodic face stands where its owner has it. Between rebuilds of the pair list an owned particle may leave its block, or the
// box across a periodic face, by up to half a skin.
struct ParticleStore {
  std::size_t owned = 0;
  std::vector<ParticleRow> rows;          //    owned + ghosts
  std::vector<double> spin_z;             //    owned + ghosts, rad/s
  std::vector<std::int64_t> id;           //    owned + ghosts
  std::vector<Vec3> gas_force;            // N  owned; over the sub-steps of a gas step; empty without gas
  std::vector<GasResponse> gas_response;  // owned; empty unless the force is relaxed

  Vec3& position(std::size_t i) { return rows[i].position; }
  Vec3& velocity(std::size_t i) { return rows[i].velocity; }
  const Vec3& position(std::size_t i) const { return rows[i].position; }
  const Vec3& velocity(std::size_t i) const { return rows[i].velocity; }
  Vec3 spin(std::size_t i) const { return {rows[i].spin_x, rows[i].spin_y, spin_z[i]}; }
  void set_spin(std::size_t i, Vec3 spin) { rows[i].spin_x = spin.x, rows[i].spin_y = spin.y, spin_z[i] = spin.z; }

  // Appends an owned particle; there are no ghosts yet.
  void add(std::int64_t identity, Vec3 place, Vec3 speed, Vec3 spin) {
    rows.push_back({place, speed, spin.x, spin.y});
    spin_z.push_back(spin.z);
    id.push_back(identity);
    owned = rows.size();
  }
  // Of the owned particles, for output.
  std::vector<Vec3> positions() const {
    return owned_vectors([](const ParticleStore& s, std::size_t i) { return s.position(i); });
  }
  std::vector<Vec3> velocities() const {
    return owned_vectors([](const ParticleStore& s, std::size_t i) { return s.velocity(i); });
  }
  std::vector<Vec3> spins() const {
    return owned_vectors([](const ParticleStore& s, std::size_t i) { return s.spin(i); });
  }
  void resize(std::size_t size) {
    rows.resize(size);
    spin_z.resize(size);
    id.resize(size);
  }

 private:
  template <class Of>
  std::vector<Vec3> owned_vectors(Of of) const {
    std::vector<Vec3> result(owned);
    for (std::size_t i = 0; i < owned; ++i) result[i] = of(*this, i);
    return result;
  }
};

enum class Side { wall, open, periodic };  // what a face of the box is for particles

struct DemSetup {
  double radius = 0;                           // m
  double mass = 0;                             // kg
  Vec3 gravity;                                // m/s²
  double skin = 0;                             // extra reach of the pair list, m
  bool rotation = false;                       // the tangential law makes the particles spin
  bool history = false;                        // the tangential law has a memory
  GasForce gas = GasForce::none;               // what of gas_force and gas_response is used
  std::array<std::array<Side, 2>, 3> sides{};  // [direction][low, high]

  double inertia() const { return 0.4 * mass * radius * radius; }
};

}  // namespace bedflow
