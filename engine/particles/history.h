// The tangential displacements of touching contacts, held by particle while the pair list that holds them by pair is rebuilt
// or particles change rank.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vec3.h"

namespace bedflow {

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

// A chain of contacts for each owned particle. A pair of two owned particles stands in both chains, so a particle that leaves
// takes all its contacts along and leaves none of the others' without.
class ContactHistory {
 public:
  struct Contact {
    std::int64_t other;  // id of the other particle, or wall_contact(wall)
    Vec3 displacement;   // as seen by the lower id of a pair
    std::int32_t next;
  };
  static constexpr std::int64_t wall_contact(int wall) { return -1 - wall; }
  static constexpr int wall_of(std::int64_t other) { return static_cast<int>(-1 - other); }

  void clear(std::size_t particles) {
    head_.assign(particles, none);
    contacts_.clear();
  }
  std::size_t append_particle() {
    head_.push_back(none);
    return head_.size() - 1;
  }
  void add(std::size_t particle, std::int64_t other, Vec3 displacement) {
    contacts_.push_back({other, displacement, head_[particle]});
    head_[particle] = static_cast<std::int32_t>(contacts_.size()) - 1;
  }
  // 0 for a contact that is not known.
  Vec3 find(std::size_t particle, std::int64_t other) const {
    for (std::int32_t c = head_[particle]; c != none; c = contacts_[c].next)
      if (contacts_[c].other == other) return contacts_[c].displacement;
    return {};
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
