// The pairs of particles, and of particles and faces of the box, that can meet before the next rebuild.
//
// Built from the places at the rebuild with the reach ri + rj + skin (walls: r + skin/2): while no particle is further than
// skin/2 from its place, no contact can be missed (Verlet 1967). Each type of particles has cells of its own size, so small ones
// among large ones cost what small ones cost (Ogarko & Luding 2012, Comput. Phys. Commun. 183, 931).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/simd.h"
#include "geometry/plane.h"
#include "particles/cells.h"
#include "particles/history.h"
#include "particles/store.h"

namespace bedflow {

// What a contact in the list remembers, and the sub-step in which it last touched: a contact that was apart starts anew.
struct alignas(32) MemoryRow {
  static constexpr double never = -1;

  Vec3 value;
  double touched = never;  // number of the sub-step
};

struct PairList {
  struct Pair {
    std::uint32_t first, second;  // rows; by type, then by id, so both owners of a pair across ranks compute the same bits
  };
  // The pairs of two types: pairs of owned rows, then from `across` on those of an owned one and a ghost.
  struct Group {
    std::size_t types[2];
    std::size_t first = 0, across = 0, last = 0;
  };
  struct NearFace {
    std::uint32_t particle;
    int face;  // 2·direction + side
  };
  // Of pairs or of near faces; empty where the law has no memory.
  struct Memory {
    std::vector<MemoryRow> displacement, angle;
  };

  std::vector<Pair> pairs;  // by group; behind the last one a register of pairs that are none
  std::vector<Group> groups;
  std::vector<NearFace> near;  // by face
  Memory pair_memory, wall_memory;

  // From the owned particles, sorted by type and in space, and the ghosts at their places at the rebuild. cells: of each type's
  // rows; shifts: of the ghosts.
  void build(const std::vector<Cells>& cells, const DemSetup& setup, const std::array<Plane, 6>& faces,
             const ParticleStore& particles, std::span<const Vec3> places, std::span<const Vec3> shifts);

  std::size_t count() const { return groups.back().last; }

  // Calls found(index, memory as the first row or the particle sees it) for the contacts that touched in sub-step `now`.
  template <class Found>
  void each_pair_memory(double now, Found found) const {
    each_memory(pair_memory, now, found);
  }
  template <class Found>
  void each_wall_memory(double now, Found found) const {
    each_memory(wall_memory, now, found);
  }
  // Hands the memory of what touched in sub-step `now` over to the particles, and back to the pairs of a new list.
  void save(const ParticleStore& particles, double now, ContactHistory& history) const;
  void load(const ParticleStore& particles, double now, const ContactHistory& history);

 private:
  template <class Found>
  static void each_memory(const Memory& memory, double now, Found found) {
    const auto touched = [&](const std::vector<MemoryRow>& rows, std::size_t i) {
      return !rows.empty() && rows[i].touched == now;
    };
    for (std::size_t i = 0; i < std::max(memory.displacement.size(), memory.angle.size()); ++i) {
      if (touched(memory.displacement, i) || touched(memory.angle, i)) {
        found(i, ContactMemory{memory.displacement.empty() ? Vec3{} : memory.displacement[i].value,
                               memory.angle.empty() ? Vec3{} : memory.angle[i].value});
      }
    }
  }
  void build_near(const DemSetup& setup, const std::array<Plane, 6>& faces, const ParticleStore& particles,
                  std::span<const Vec3> places);
  void sort_into_groups(const DemSetup& setup, const ParticleStore& particles);
};

}  // namespace bedflow
