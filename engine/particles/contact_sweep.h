// Forces and torques of all contacts of a sub-step, between particles and on walls. Templates over the laws: what a law does
// not need is not in the loop.
//
//   n = (Xj − Xi)/|Xj − Xi|,  δ = 2r − |Xj − Xi|,  Vij = Vi − Vj + ℓ(ωi + ωj) × n,  ℓ = |Xj − Xi|/2
//   F_i = −F_j = −F_n n + F_t,  T_i = T_j = ℓ n × F_t                (Cundall & Strack 1979; a wall: ℓ = distance to it)
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/tangential.h"
#include "particles/pair_list.h"
#include "particles/store.h"

namespace bedflow {

// Rows of owned + ghosts; torque and spin only where the law makes particles rotate.
struct Bodies {
  const ParticleStore& particles;
  Vec3* force;
  Vec3* torque;
  std::size_t owned;
  const Vec3* shift;  // of ghosts, see GhostExchange

  // From one row of a pair to the other; with a ghost among them, the way its nearest image stands.
  template <bool with_ghost>
  Vec3 apart(PairList::Pair pair) const {
    const Vec3 direct = particles.position(pair.high) - particles.position(pair.low);
    if constexpr (!with_ghost) return direct;
    return direct + (pair.low < owned ? shift[pair.high - owned] : -shift[pair.low - owned]);
  }
};

// Writes the indices of touching pairs in [first, last) to `touching` and returns how many. Without branches: in a bed about
// as many pairs touch as do not. A pair apart forgets its displacement.
template <bool with_ghost, bool history>
std::size_t find_touching(PairList& list, std::size_t first, std::size_t last, const Bodies& bodies, double diameter,
                          std::uint32_t* touching) {
  std::size_t count = 0;
  for (std::size_t p = first; p < last; ++p) {
    const Vec3 apart = bodies.apart<with_ghost>(list.pairs[p]);
    const bool touch = dot(apart, apart) < diameter * diameter;
    touching[count] = static_cast<std::uint32_t>(p);
    count += touch;
    if constexpr (history) list.pair_history[p] *= touch;
  }
  return count;
}

// Adds the forces of the touching pairs to their owned rows; returns the largest overlap, m.
template <bool with_ghost, class Contact, class Tangential>
double sweep_pairs(PairList& list, const std::uint32_t* touching, std::size_t count, const Bodies& bodies, const Contact& contact,
                   const Tangential& tangential, double radius, double mass, double dt) {
  double deepest = 0;
  for (std::size_t c = 0; c < count; ++c) {
    const auto pair = list.pairs[touching[c]];
    const auto [a, b] = pair;
    const Vec3 apart = bodies.apart<with_ghost>(pair);
    const double distance = norm(apart), overlap = 2 * radius - distance;
    const Vec3 n = 1 / distance * apart;
    const Vec3 v = bodies.particles.velocity(a) - bodies.particles.velocity(b);
    const double approach = dot(v, n), normal = contact(overlap, approach);
    deepest = std::max(deepest, overlap);
    Vec3 force = -normal * n;
    if constexpr (Tangential::rotation) {
      const double arm = 0.5 * distance;
      const Vec3 slip = v - approach * n + cross(arm * (bodies.particles.spin(a) + bodies.particles.spin(b)), n);
      const Sliding sliding{n, slip, std::abs(normal), mass / 7, dt};  // 2/7 m*, m* = m/2
      Vec3 friction;
      if constexpr (Tangential::history) {
        friction = tangential(sliding, list.pair_history[touching[c]]);
      } else {
        friction = tangential(sliding);
      }
      force += friction;
      const Vec3 torque = arm * cross(n, friction);
      if (!with_ghost || a < bodies.owned) bodies.torque[a] += torque;
      if (!with_ghost || b < bodies.owned) bodies.torque[b] += torque;
    }
    if (!with_ghost || a < bodies.owned) bodies.force[a] += force;
    if (!with_ghost || b < bodies.owned) bodies.force[b] -= force;
  }
  return deepest;
}

struct WallSweep {
  double deepest = 0;   // largest overlap, m
  bool passed = false;  // a centre is beyond a face of the box
};

// Adds the forces of walls. Every face counts once, also two or three at an edge or a corner.
template <class Contact, class Tangential>
WallSweep sweep_walls(PairList& list, const std::array<Plane, 6>& faces, const DemSetup& setup, const Bodies& bodies,
                      const Contact& contact, const Tangential& tangential, double dt) {
  WallSweep result;
  for (std::size_t w = 0; w < list.near.size(); ++w) {
    const auto [i, face] = list.near[w];
    const double distance = faces[face].distance(bodies.particles.position(i)), overlap = setup.radius - distance;
    result.passed |= !(distance >= 0);
    if (!(overlap > 0) || setup.sides[face / 2][face % 2] == Side::open) {
      if constexpr (Tangential::history) list.wall_history[w] = {};
      continue;
    }
    const Vec3 n = -faces[face].normal, v = bodies.particles.velocity(i);
    const double approach = dot(v, n), normal = contact(overlap, approach);
    result.deepest = std::max(result.deepest, overlap);
    Vec3 force = -normal * n;
    if constexpr (Tangential::rotation) {
      const Vec3 slip = v - approach * n + cross(distance * bodies.particles.spin(i), n);
      const Sliding sliding{n, slip, std::abs(normal), 2 * setup.mass / 7, dt};  // m* = m
      Vec3 friction;
      if constexpr (Tangential::history) {
        friction = tangential(sliding, list.wall_history[w]);
      } else {
        friction = tangential(sliding);
      }
      force += friction;
      bodies.torque[i] += distance * cross(n, friction);
    }
    bodies.force[i] += force;
  }
  return result;
}

}  // namespace bedflow
