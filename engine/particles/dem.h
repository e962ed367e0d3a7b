// The particles of a rank and their motion through contacts: ghosts, pair list, contact sweeps, walls, integration.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/phase_timer.h"
#include "base/stop.h"
#include "base/vec3.h"
#include "geometry/plane.h"
#include "parallel/decomposition.h"
#include "parallel/ghosts.h"
#include "particles/cells.h"
#include "particles/contact_sweep.h"
#include "particles/history.h"
#include "particles/pair_list.h"
#include "particles/store.h"

namespace bedflow {

// A law with its parameters for two particles and for a particle on a wall.
template <class Law>
struct PairAndWall {
  Law pair, wall;
};

class Dem {
 public:
  // Collective. Throws Stop(invalid_case) when a block, or a periodic direction, is narrower than the reach of its particles.
  Dem(const Decomposition& decomposition, const DemSetup& setup, PhaseTimer& timer);

  const DemSetup& setup() const { return setup_; }
  const ParticleStore& particles() const { return particles_; }
  ParticleStore& particles() { return particles_; }

  // Replaces all particles of this rank, each inside this rank's block (ghosts are made here). Collective.
  void set_particles(ParticleStore particles);

  // n sub-steps of dt (s): contact sweep, walls, integrate; then pairs (rebuilt only when needed) or ghosts; symplectic Euler.
  // Explicitly instantiated for every law of models/ in dem.cpp. Collective. After a failure on any rank no rank moves on.
  template <class Contact, class Tangential>
  void advance(int substeps, double dt, const PairAndWall<Contact>& contact, const PairAndWall<Tangential>& tangential);

  // Largest overlap since the last take, over the diameter, this rank.
  double take_max_overlap();
  double max_overlap() const { return deepest_ / (2 * setup_.radius); }
  // Touching pairs in the last sub-step; a pair across ranks is counted by the owner of its lower id.
  std::int64_t contacts() const { return contacts_; }
  std::int64_t rebuilds() const { return rebuilds_; }  // of the pair list since construction
  // PARTICLE_LOST (id, place), DIVERGED (not finite, or further than its diameter in one sub-step): noted on this rank, to be
  // voted on.
  const Failure& failure() const { return failure_; }
  double kinetic_energy() const;  // J, this rank, translation and rotation

  // What a checkpoint must hold beside the particles so that the same ranks go on with the same bits: the places at the
  // last rebuild of the pair list, and the histories of touching contacts. A pair across ranks is told by the owner of `low`.
  const std::vector<Vec3>& positions_at_rebuild() const { return place_; }  // owned
  std::vector<PairHistory> pair_histories() const;
  std::vector<WallHistory> wall_histories() const;
  // Same ranks: particles in their stored order with their places at the last rebuild; rebuilds exactly that list.
  // Other ranks: positions_at_rebuild empty on all, a fresh list; the particles are this block's (redistribute() in migration.h).
  // Histories: of all ranks together those of all contacts, each told by any rank, once. Collective.
  void restore(ParticleStore particles, std::vector<Vec3> positions_at_rebuild, const std::vector<PairHistory>& pairs,
               const std::vector<WallHistory>& walls);

 private:
  double reach() const { return 2 * setup_.radius + setup_.skin; }
  Bodies bodies();
  void drop_ghosts();
  void forward_ghosts();
  void rebuild();
  void build_list();
  void keep_list_valid(bool far, double dt);
  void look_for_lost(double dt);
  bool judge(std::size_t row, double dt);

  const Decomposition& decomposition_;
  DemSetup setup_;
  PhaseTimer& timer_;
  std::array<Plane, 6> faces_;
  GhostExchange ghosts_;
  ParticleStore particles_;
  std::vector<Vec3> place_;           // owned, at the last rebuild
  std::vector<Vec3> force_, torque_;  // owned, 0 between sub-steps
  Cells cells_;
  PairList list_;
  ContactHistory history_;               // only while the list is rebuilt
  std::vector<std::uint32_t> touching_;  // of list_.pairs
  std::vector<Vec3> scratch_, all_places_;
  double deepest_ = 0;
  std::int64_t contacts_ = 0, rebuilds_ = 0;
  Failure failure_;
  bool stopped_ = false;  // agreed by all ranks
};

}  // namespace bedflow
