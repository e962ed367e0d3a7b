// The particles of a rank and their motion through contacts: ghosts, pair list, contact sweeps, walls, integration.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/phase_timer.h"
#include "base/stop.h"
#include "base/vec3.h"
#include "parallel/decomposition.h"

namespace bedflow {

// Structure of arrays, sorted in space; owned particles first, then ghosts (copies of what other ranks, or other periodic
// images, own).
struct ParticleStore {
  std::size_t owned = 0;
  std::vector<Vec3> position;    // m            owned + ghosts
  std::vector<Vec3> velocity;    // m/s          owned + ghosts
  std::vector<Vec3> spin;        // ω, rad/s     owned + ghosts; empty without friction
  std::vector<std::int64_t> id;  //              owned + ghosts
  std::vector<Vec3> gas_force;   // N            owned; frozen over the sub-steps of a gas step; empty without gas
};

enum class Side { wall, open, periodic };  // what a face of the box is for particles

struct DemSetup {
  double radius = 0;                           // m
  double mass = 0;                             // kg
  Vec3 gravity;                                // m/s²
  double skin = 0;                             // extra reach of the pair list, m
  bool rotation = false;                       // the tangential law makes the particles spin
  bool history = false;                        // the tangential law has a memory
  bool gas = false;                            // gas_force is used
  std::array<std::array<Side, 2>, 3> sides{};  // [direction][low, high]

  double inertia() const { return 0.4 * mass * radius * radius; }
};

// A law with its parameters for two particles and for a particle on a wall.
template <class Law>
struct PairAndWall {
  Law pair, wall;
};

// Tangential displacement ξ (m) of a touching contact, by the ids of its particles (low < high), or of a particle and the wall
// 2·direction + side.
struct PairHistory {
  std::int64_t low, high;
  Vec3 displacement;  // as seen by `low`
};
struct WallHistory {
  std::int64_t id;
  int wall;
  Vec3 displacement;
};

class Dem {
 public:
  Dem(const Decomposition& decomposition, const DemSetup& setup, PhaseTimer& timer);

  const DemSetup& setup() const;
  const ParticleStore& particles() const;
  ParticleStore& particles();

  // Replaces all particles of this rank, each inside this rank's block (ghosts are made here). spin may be empty.
  void set_particles(std::vector<Vec3> position, std::vector<Vec3> velocity, std::vector<Vec3> spin,
                     std::vector<std::int64_t> id);

  // n sub-steps of dt (s): pairs (rebuilt only when needed), contact sweep, walls, integrate, ghosts; symplectic Euler.
  // Explicitly instantiated for every law of models/ in dem.cpp.
  template <class Contact, class Tangential>
  void advance(int substeps, double dt, const PairAndWall<Contact>& contact, const PairAndWall<Tangential>& tangential);

  // Largest overlap since the last call, over the diameter, this rank.
  double take_max_overlap();
  std::int64_t contacts() const;   // touching pairs in the last sub-step, this rank; a pair across ranks counts half on each
  std::int64_t rebuilds() const;   // of the pair list since construction
  const Failure& failure() const;  // PARTICLE_LOST (id, place), DIVERGED (not finite): noted on this rank, to be voted on
  double kinetic_energy() const;   // J, this rank, translation and rotation

  // What a checkpoint must hold beside the particles so that the same ranks go on with the same bits: the places at the
  // last rebuild of the pair list, and the histories of touching contacts. A pair across ranks is told by the owner of `low`.
  const std::vector<Vec3>& positions_at_rebuild() const;  // owned
  std::vector<PairHistory> pair_histories() const;
  std::vector<WallHistory> wall_histories() const;
  // Same ranks: particles in their stored order with their places at the last rebuild; rebuilds exactly that list.
  // Other ranks: positions_at_rebuild empty, a fresh list. Histories are those of any contact that touches an owned particle
  // (more are ignored).
  void restore(ParticleStore particles, std::vector<Vec3> positions_at_rebuild, const std::vector<PairHistory>& pairs,
               const std::vector<WallHistory>& walls);

 private:
};

}  // namespace bedflow
