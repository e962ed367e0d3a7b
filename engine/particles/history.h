// The memory of touching contacts, held by particle while the pair list that holds it by pair is rebuilt or particles change
// rank.
#pragma once

#include <cstdint>
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
// takes all its contacts along and leaves none of the others' without.
class ContactHistory {
 public:
  struct Contact {
    std::int64_t other;    // id of the other particle, or wall_contact(wall)
    ContactMemory memory;  // as seen by the particle whose chain this is
    std::int32_t next;
  };
  static constexpr std::int64_t wall_contact(std::int64_t wall) { return -1 - wall; }
  static constexpr std::int64_t wall_of(std::int64_t other) { return -1 - other; }

  void clear(std::size_t particles) {
    head_.assign(particles, none);
    contacts_.clear();
  }
  std::size_t append_particle() {
    head_.push_back(none);
    return head_.size() - 1;
  }
  void add(std::size_t particle, std::int64_t other, const ContactMemory& memory) {
    contacts_.push_back({other, memory, head_[particle]});
    head_[particle] = static_cast<std::int32_t>(contacts_.size()) - 1;
  }
  // Null for a contact that is not known.
  const ContactMemory* find(std::size_t particle, std::int64_t other) const {
    for (std::int32_t c = head_[particle]; c != none; c = contacts_[c].next)
      if (contacts_[c].other == other) return &contacts_[c].memory;
    return nullptr;
  }
  template <class Apply>
  void for_each(std::size_t particle, Apply apply) const {
    for (std::int32_t c = head_[particle]; c != none; c = contacts_[c].next) apply(contacts_[c]);
  }
  std::vector<std::int32_t>& heads() { return head_; }  // one a particle, moved with it

 private:
  static constexpr std::int32_t none = -1;

  std::vector<std::int32_t> head_;
  std::vector<Contact> contacts_;
};

}  // namespace bedflow
