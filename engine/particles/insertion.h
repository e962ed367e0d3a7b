// Particles that enter through patches of the faces of the box.
//
// What enters is decided on all ranks alike: rate × time says how many are due, a counter which type and size comes next and
// where it tries to enter. Each rank says which of the tries its own particles block; one reduction a patch and step tells all. A
// particle that finds no room waits, and those behind it with it, so that the mixture is kept; it is due until it enters.
#pragma once

#include <cstdint>
#include <vector>

#include "parallel/decomposition.h"
#include "particles/seeding.h"
#include "particles/sizes.h"
#include "particles/store.h"
#include "particles/turnover.h"

namespace bedflow {

struct Inlet {
  int direction = 0, side = 0;
  Vec3 low, high;   // corners of the patch, m; that part of them normal to the face is not used
  double rate = 0;  // particles or kg a second
  Basis basis = Basis::number;
  Vec3 velocity;               // m/s
  std::vector<double> shares;  // of the kinds, by number
  double from = 0;             // s
  double until = 0;            // s
  std::uint64_t seed = 0;
};

// What has gone through an inlet: with the case all that the next particle depends on.
struct InletState {
  std::int64_t entered = 0;
  double mass = 0;           // of those that entered, kg
  std::int64_t draws = 0;    // of places
  std::int64_t blocked = 0;  // steps in which one that was due found no room
};

// How many particles enter until `end` (s), if there is room.
std::int64_t expected_count(const std::vector<SeedKind>& kinds, const Inlet& inlet, double end);

class Insertion {
 public:
  Insertion(const Decomposition& decomposition, const DemSetup& setup, std::vector<SeedKind> kinds, std::vector<Inlet> inlets);

  // The particles that enter in a step that ends at `time` after dt (s), the same on all ranks: wholly inside the box, apart from
  // each other and from all particles. Ids from next_id on, which is advanced. Collective.
  std::vector<Newcomer> enter(double time, double dt, const ParticleStore& particles, std::int64_t& next_id);

  double mass_due(double time) const;  // of all inlets: what rate × time says less what has entered, kg
  const std::vector<InletState>& states() const { return states_; }
  void restore(std::vector<InletState> states);  // one an inlet; throws Stop(invalid_case)

 private:
  double due(const Inlet& inlet, const InletState& state, double time) const;
  PlacedSphere next(const Inlet& inlet, std::int64_t serial) const;
  std::vector<PlacedSphere> waiting(const Inlet& inlet, const InletState& state, double time) const;
  Vec3 place(const Inlet& inlet, double radius, double dt, std::uint64_t draw) const;
  bool overlap(Vec3 a, Vec3 b, double distance) const;
  std::vector<double> blocked(const std::vector<PlacedSphere>& batch, const std::vector<Vec3>& tries,
                              const ParticleStore& particles) const;
  void enter_through(std::size_t inlet, double time, double dt, const ParticleStore& particles, std::int64_t& next_id,
                     std::vector<Newcomer>& entered);

  const Decomposition& decomposition_;
  const DemSetup& setup_;
  std::vector<SeedKind> kinds_;
  std::vector<Inlet> inlets_;
  std::vector<InletState> states_;
};

}  // namespace bedflow
