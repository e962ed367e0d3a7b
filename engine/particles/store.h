// What a rank keeps of its particles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vec3.h"

namespace bedflow {

// Structure of arrays, sorted in space; owned particles first, then ghosts (copies of what other ranks, or other periodic
// images, own). A ghost across a periodic face stands where its owner has it. Between rebuilds of the pair list an owned
// particle may leave its block, or the box across a periodic face, by up to half a skin.
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

}  // namespace bedflow
