// What a rank keeps of its particles.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "base/sphere.h"
#include "base/vec3.h"

namespace bedflow {

enum class Side { wall, open, outlet, periodic };  // what a face of the box is for particles: through an outlet they may leave

// Spheres of one material and one size, or one range of sizes.
struct ParticleType {
  double radius = 0;         // m; the largest when sizes are distributed
  double density = 0;        // kg/m³
  bool distributed = false;  // each particle has a radius of its own, in ParticleStore::radius

  double mass() const { return mass_of(radius); }
  double mass_of(double r) const { return density * sphere_volume(2 * r); }
};

// How the force of the gas follows a particle's velocity within a gas step, and what the gas has not lost yet.
struct GasResponse {
  double drag = 0;   // b, kg/s: the force is gas_force − b V
  double share = 1;  // mean of that force over a sub-step over the force at its start: (1 − e^−z)/z, z = b dt/m
  Vec3 debt;         // N·s received so far less what the gas loses for it
};

enum class GasForce { none, frozen, relaxed };  // over the sub-steps of a gas step

struct DemSetup {
  std::vector<ParticleType> types;             // one at least
  Vec3 gravity;                                // m/s²
  double skin = 0;                             // extra reach of the pair list, m
  double widest_skin = 0;                      // to which it may be tuned, m; 0: it stays
  double range = 0;                            // gap over which particles attract each other, m
  bool rotation = false;                       // the tangential law makes the particles spin
  bool history = false;                        // the tangential law has a memory
  bool rolling_history = false;                // the rolling law has one
  bool verlet = false;                         // velocity Verlet, else symplectic Euler
  GasForce gas = GasForce::none;               // what of gas_force and gas_response is used
  std::array<std::array<Side, 2>, 3> sides{};  // [direction][low, high]

  bool distributed() const {
    return std::any_of(types.begin(), types.end(), [](const ParticleType& type) { return type.distributed; });
  }
  bool has_outlet() const {
    return std::any_of(sides.begin(), sides.end(),
                       [](const auto& pair) { return pair[0] == Side::outlet || pair[1] == Side::outlet; });
  }
  double largest_radius() const {
    double result = 0;
    for (const ParticleType& type : types) result = std::max(result, type.radius);
    return result;
  }
};

// What a contact needs of a particle: 64 bytes, one cache line, one vector register. The third component of the spin stands
// apart.
struct alignas(64) ParticleRow {
  Vec3 position;                  // m
  Vec3 velocity;                  // m/s
  double spin_x = 0, spin_y = 0;  // ω, rad/s
};

// What contacts do to a particle, laid out so that a scaled row adds to the velocity and spin of a ParticleRow.
struct alignas(64) ForceRow {
  double torque_z = 0;
  double known = 0, unused = 0;       // known: 1 once set, of a force that is kept
  Vec3 force;                         // N
  double torque_x = 0, torque_y = 0;  // N m

  Vec3 torque() const { return {torque_x, torque_y, torque_z}; }
  void add(Vec3 f, Vec3 t) {
    force += f;
    torque_x += t.x, torque_y += t.y, torque_z += t.z;
  }
};

// Sorted by type and in space; owned particles first, then ghosts (copies of what other ranks, or other periodic images, own). A
// ghost across a periodic face stands where its owner has it. Between rebuilds of the pair list an owned particle may leave its
// block, or the box across a periodic face, by up to half a skin.
struct ParticleStore {
  std::size_t owned = 0;
  std::vector<ParticleRow> rows;          //    owned + ghosts
  std::vector<double> spin_z;             //    owned + ghosts, rad/s
  std::vector<std::int64_t> id;           //    owned + ghosts
  std::vector<std::uint8_t> type;         //    owned + ghosts, index into DemSetup::types; empty with one type
  std::vector<double> radius;             // m  owned + ghosts; empty unless the sizes of a type are distributed
  std::vector<Vec3> gas_force;            // N  owned; over the sub-steps of a gas step; empty without gas
  std::vector<GasResponse> gas_response;  // owned; empty unless the force is relaxed
  std::vector<ForceRow> previous;         //    owned; contact forces of the last sub-step; empty without velocity Verlet

  Vec3& position(std::size_t i) { return rows[i].position; }
  Vec3& velocity(std::size_t i) { return rows[i].velocity; }
  const Vec3& position(std::size_t i) const { return rows[i].position; }
  const Vec3& velocity(std::size_t i) const { return rows[i].velocity; }
  Vec3 spin(std::size_t i) const { return {rows[i].spin_x, rows[i].spin_y, spin_z[i]}; }
  void set_spin(std::size_t i, Vec3 spin) { rows[i].spin_x = spin.x, rows[i].spin_y = spin.y, spin_z[i] = spin.z; }

  // Appends an owned particle of the first type; there are no ghosts yet.
  void add(std::int64_t identity, Vec3 place, Vec3 speed, Vec3 turn) {
    rows.push_back({place, speed, turn.x, turn.y});
    spin_z.push_back(turn.z);
    id.push_back(identity);
    owned = rows.size();
  }
  // The same of any type and size.
  void add(const DemSetup& setup, std::int64_t identity, Vec3 place, Vec3 speed, Vec3 turn, int kind, double size) {
    add(identity, place, speed, turn);
    if (setup.types.size() > 1) type.push_back(static_cast<std::uint8_t>(kind));
    if (setup.distributed()) radius.push_back(size);
  }
  // Calls f(array) for every array that such a setup keeps for owned particles.
  template <class Apply>
  void each_array(const DemSetup& setup, Apply f) {
    f(rows);
    f(spin_z);
    f(id);
    if (setup.types.size() > 1) f(type);
    if (setup.distributed()) f(radius);
    if (setup.gas != GasForce::none) f(gas_force);
    if (setup.gas == GasForce::relaxed) f(gas_response);
    if (setup.verlet) f(previous);
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

 private:
  template <class Of>
  std::vector<Vec3> owned_vectors(Of of) const {
    std::vector<Vec3> result(owned);
    for (std::size_t i = 0; i < owned; ++i) result[i] = of(*this, i);
    return result;
  }
};

inline const ParticleType& type_of(const std::vector<ParticleType>& types, const ParticleStore& particles, std::size_t i) {
  return types[particles.type.empty() ? 0 : particles.type[i]];
}
inline double radius_of(const std::vector<ParticleType>& types, const ParticleStore& particles, std::size_t i) {
  return particles.radius.empty() ? type_of(types, particles, i).radius : particles.radius[i];
}
inline double mass_of(const std::vector<ParticleType>& types, const ParticleStore& particles, std::size_t i) {
  return type_of(types, particles, i).mass_of(radius_of(types, particles, i));
}

}  // namespace bedflow
