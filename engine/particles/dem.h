// The particles of a rank and their motion through contacts: ghosts, pair list, contact sweeps, walls, integration.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/phase_timer.h"
#include "base/stop.h"
#include "base/vec3.h"
#include "geometry/plane.h"
#include "parallel/decomposition.h"
#include "parallel/ghosts.h"
#include "particles/cells.h"
#include "particles/forces.h"
#include "particles/history.h"
#include "particles/laws.h"
#include "particles/pair_list.h"
#include "particles/reorder.h"
#include "particles/skin_tuner.h"
#include "particles/store.h"
#include "particles/turnover.h"
#include "particles/walls.h"

namespace bedflow {

class Dem {
 public:
  // Collective. Throws Stop(invalid_case) when a block, or a periodic direction, is narrower than the reach of its particles.
  // What the laws require (rotation, memory, range) is added to the setup.
  Dem(const Decomposition& decomposition, const DemSetup& setup, ContactLaws laws, PhaseTimer& timer,
      std::vector<Wall> walls = {});

  const DemSetup& setup() const { return setup_; }
  const ParticleStore& particles() const { return particles_; }
  ParticleStore& particles() { return particles_; }

  // Particles that enter, the same on all ranks, each taken by its owner; the list is rebuilt. Collective.
  void enter(const std::vector<Newcomer>& newcomers);
  // What left through outlets since the last take, this rank. A particle is taken out when the pair list is rebuilt: until then
  // it is beyond the face by half a skin at most, and goes on pushing those behind it.
  Departed take_departed() { return std::exchange(departed_, {}); }

  // Replaces all particles of this rank, each inside this rank's block (ghosts are made here). Collective.
  void set_particles(ParticleStore particles);

  // Other parameters of laws that require no more than the present ones, from the next sub-step on.
  void use(ContactLaws laws);
  // Sub-steps of dt (s): contacts, walls, motion; then pairs (rebuilt only when needed) or ghosts. Collective. After a failure on
  // any rank no rank moves on. time: s, at the start, for walls that move; absent: they rest where they are at time 0.
  void advance(int substeps, double dt, std::optional<double> time = {});

  // Largest overlap since the last take, over the sum of the two radii (on a wall the diameter), this rank.
  double take_max_overlap();
  double max_overlap() const { return deepest_; }
  // What contacts give and hold. Opened at the start of the next sub-step; collective of none.
  struct Energy {
    double given = 0;   // work of the contacts on the particles since then, less that of walls that move, this rank, J
    double stored = 0;  // in springs at its opening, this rank (half of a pair across ranks), J
    double bound = 0;   // less the work that attraction could do, in the same contacts: below 0, J
    // By contacts while the account before was open, J: given + stored + bound at its end less those at its start.
    double created = 0;
  };
  void open_energy_account() { opening_ = true; }
  const Energy& energy_account() const { return energy_; }
  // Touching pairs in the last sub-step; a pair across ranks is counted by one of them.
  std::int64_t contact_count() const { return contacts_; }
  // Where the tuning of the skin stands; a checkpoint holds it too.
  struct Tuning {
    double skin = 0;  // m
    SkinTuner::Counts counts;
  };
  Tuning tuning() const { return {setup_.skin, tuner_.counts}; }
  void set_tuning(const Tuning& tuning);               // before restore()
  std::int64_t rebuilds() const { return rebuilds_; }  // of the pair list since construction
  std::vector<int> listed_pairs() const;               // of each owned particle
  // The contact of this rank that overlaps most at the places the particles have now.
  struct DeepContact {
    double overlap = 0;        // over the sum of the radii, on a face of the box over the diameter; 0: there is none
    std::int64_t first = 0;    // ids
    std::int64_t second = -1;  // -1: a face of the box
    Vec3 place;                // of the first, m
  };
  DeepContact deepest_contact() const;
  // PARTICLE_LOST (id, place), DIVERGED (not finite, or further than its diameter in one sub-step): noted on this rank, to be
  // voted on.
  const Failure& failure() const { return failure_; }
  // What the particles of this rank did to the faces of the box and to the walls, the mean over the sub-steps since the last
  // take.
  std::vector<WallLoad> take_wall_loads();
  bool stopped() const { return stopped_; }  // by a failure on any rank, agreed by all
  double kinetic_energy() const;             // J, this rank, translation and rotation

  // What a checkpoint must hold beside the particles so that the same ranks go on with the same bits: the places at the
  // last rebuild of the pair list, and the histories of touching contacts. A pair across ranks is told by one of them.
  std::vector<Vec3> positions_at_rebuild() const;  // owned
  std::vector<PairHistory> pair_histories() const;
  std::vector<WallHistory> wall_histories() const;
  // Same ranks: particles in their stored order with their places at the last rebuild; rebuilds exactly that list.
  // Other ranks: positions_at_rebuild empty on all, a fresh list; the particles are this block's (redistribute() in migration.h).
  // Histories: of all ranks together those of all contacts, each told by any rank, once. Collective.
  void restore(ParticleStore particles, const std::vector<Vec3>& positions_at_rebuild, const std::vector<PairHistory>& pairs,
               const std::vector<WallHistory>& walls);

 private:
  double reach_with(double skin) const { return 2 * setup_.largest_radius() + setup_.range + skin; }
  double reach() const { return reach_with(setup_.skin); }
  void drop_ghosts();
  void take_ghosts();
  void forward_ghosts();
  void sort();
  void rebuild();
  void build_list();
  void tune_skin();
  void keep_list_valid(bool far, double dt);
  void contacts(const Bodies& bodies);
  void walls(const Bodies& bodies, std::optional<double> time);
  void open_account();
  bool move(double dt);
  void look_for_lost(double dt);
  bool judge(std::size_t row, double dt);

  const Decomposition& decomposition_;
  DemSetup setup_;
  ContactLaws laws_;
  PhaseTimer& timer_;
  std::array<Plane, 6> faces_;
  GhostExchange ghosts_;
  ParticleStore particles_;
  std::vector<Vec3> place_;      // at the last rebuild: owned, ghosts, and one more that is none
  std::vector<ForceRow> force_;  // owned, 0 between sub-steps
  std::vector<Cells> cells_;     // of each type
  PairList list_;
  SkinTuner tuner_;
  Walls walls_;
  std::vector<WallLoad> loads_;  // of the six faces, then of the walls: summed over the sub-steps
  int loaded_ = 0;               // sub-steps in them
  ContactHistory history_;       // while the list is rebuilt
  Reorder reorder_;              // likewise
  double now_ = 0;               // number of the last sub-step
  double deepest_ = 0;
  std::int64_t contacts_ = 0, rebuilds_ = 0;
  Energy energy_;
  bool opening_ = false, opened_ = false;
  double power_of_walls_ = 0;        // in the sub-step, W
  std::vector<Newcomer> newcomers_;  // of this rank, until the list is rebuilt
  Departed departed_;
  Failure failure_;
  bool stopped_ = false;  // agreed by all ranks
};

}  // namespace bedflow
