// The pairs of particles, and of particles and faces of the box, that can meet before the next rebuild.
//
// Built from the places at the rebuild with the reach 2r + skin (walls: r + skin/2): while no particle is further than skin/2
// from its place, no contact can be missed (Verlet 1967).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/plane.h"
#include "particles/cells.h"
#include "particles/history.h"
#include "particles/store.h"

namespace bedflow {

struct PairList {
  struct Pair {
    std::uint32_t low, high;  // rows; the lower id first, so both owners of a pair across ranks compute the same bits
  };
  struct NearFace {
    std::uint32_t particle;
    int face;  // 2·direction + side
  };

  std::vector<Pair> pairs;         // both owned, then from `across` on those of an owned one and a ghost
  std::size_t across = 0;          // index of the first pair with a ghost
  std::vector<NearFace> near;      // by face
  std::vector<Vec3> pair_history;  // ξ of each pair (m), 0 when apart; empty when the law has no memory
  std::vector<Vec3> wall_history;  // ξ of each near face

  // From the sorted owned particles and the ghosts at their places at the rebuild; shifts: of the ghosts.
  void build(const Cells& cells, const DemSetup& setup, const std::array<Plane, 6>& faces, const ParticleStore& particles,
             std::span<const Vec3> places, std::span<const Vec3> shifts);
  // Hands the displacements over to the particles, and back to the pairs of a new list.
  void save(const ParticleStore& particles, ContactHistory& history) const;
  void load(const ParticleStore& particles, const ContactHistory& history);

 private:
  void build_near(const DemSetup& setup, const std::array<Plane, 6>& faces, std::span<const Vec3> places);
};

}  // namespace bedflow
