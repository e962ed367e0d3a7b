// The memory of touching contacts, held by particle while the pair list that holds it by pair is rebuilt or particles change
// rank.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/vec3.h"

namespace bedflow {

// What a contact remembers, as seen by one of its bodies: the other one sees the opposite.
struct ContactMemory {
  Vec3 displacement;  // tangential ξ, m
  Vec3 angle;         // rolling θ, rad

  ContactMemory operator-() const { return {-displacement, -angle}; }
};

// Memory of a touching contact, by the ids of its particles (low < high), or of a particle and a wall: 2·direction + side of a
// face of the box, or as Walls numbers its contacts.
struct PairHistory {
  std::int64_t low, high;
  ContactMemory memory;  // as seen by `low`
};
struct WallHistory {
  std::int64_t id;
  std::int64_t wall;
  ContactMemory memory;  // as seen by the particle
};

// A chain of contacts for each owned particle. A pair of two owned particles stands in both chains, so a particle that leaves
// takes all its contacts along and leaves none of the others' without. The room is kept from one rebuild to the next: taken anew
// from the system it would cost as much as filling it.
class ContactHistory {
 public:
  struct Contact {
    std::int64_t other;    // id of the other particle, or wall_contact(wall)
    ContactMemory memory;  // as seen by the particle whose chain this is
  };
  static constexpr std::int64_t wall_contact(std::int64_t wall) { return -1 - wall; }
  static constexpr std::int64_t wall_of(std::int64_t other) { return -1 - other; }

  explicit ContactHistory(bool rolling) : rolling_(rolling) {}  // rolling: angles are remembered

  void clear(std::size_t particles) {
    head_.assign(particles, none);
    links_.clear();
    angles_.clear();
  }
  std::size_t append_particle() {
    head_.push_back(none);
    return head_.size() - 1;
  }
  void add(std::size_t particle, std::int64_t other, const ContactMemory& memory) {
    links_.push_back({other, memory.displacement, head_[particle]});
    if (rolling_) angles_.push_back(memory.angle);
    head_[particle] = static_cast<std::int32_t>(links_.size()) - 1;
  }
  // Nothing for a contact that is not known.
  std::optional<ContactMemory> find(std::size_t particle, std::int64_t other) const {
    for (std::int32_t l = head_[particle]; l != none; l = links_[l].next)
      if (links_[l].other == other) return memory(l);
    return std::nullopt;
  }
  template <class Apply>
  void for_each(std::size_t particle, Apply apply) const {
    for (std::int32_t l = head_[particle]; l != none; l = links_[l].next) apply(Contact{links_[l].other, memory(l)});
  }
  std::vector<std::int32_t>& heads() { return head_; }  // one a particle, moved with it

 private:
  static constexpr std::int32_t none = -1;

  struct Link {
    std::int64_t other;
    Vec3 displacement;
    std::int32_t next;
  };
  ContactMemory memory(std::int32_t link) const { return {links_[link].displacement, rolling_ ? angles_[link] : Vec3{}}; }

  bool rolling_;
  std::vector<std::int32_t> head_;
  std::vector<Link> links_;
  std::vector<Vec3> angles_;  // of the links
};

}  // namespace bedflow
