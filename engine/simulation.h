// One coupled step. The laws of gas and coupling are visited here, those of contacts in particles/forces.h.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/phase_timer.h"
#include "checkpoint/checkpoint.h"
#include "coupling/transfer.h"
#include "energy_watch.h"
#include "gas/gas_solver.h"
#include "particles/dem.h"
#include "particles/insertion.h"
#include "particles/sizes.h"
#include "particles/turnover.h"
#include "plan.h"
#include "step_controller.h"

namespace bedflow {

class Simulation {
 public:
  Simulation(const Plan& plan, const Comm& comm, PhaseTimer& timer)
      : Simulation(plan, comm, timer, even_cuts(comm.size(), plan.cells, plan.scene.size, plan.tall, plan.narrowest)) {}
  Simulation(const Plan& plan, const Comm& comm, PhaseTimer& timer, Cuts cuts);

  // The state at time 0: gas at rest or as the case says, particles at their places. Throws Stop(invalid_case).
  void seed();
  // The same with the particles of a checkpoint, of a case with the same box and sizes, as they lie and move: what they felt and
  // remembered is left behind. Any number of ranks. Throws Stop(invalid_case).
  void seed_from(const CheckpointSource& packing);
  // Lets seeded particles fall for some sub-steps, without gas and with the settling's own restitution. False: they are at rest,
  // or no settling was asked for, or its time is over.
  bool settle();
  double settled_time() const { return settled_time_; }  // s
  // The state of a checkpoint, made on any number of ranks. Throws Stop(invalid_case) when it is of another scene. The same
  // blocks (blocks_of) go on with the same bits.
  void restore(const CheckpointSource& from);
  CheckpointContent checkpoint() const;
  // The cuts of the blocks that made the checkpoint; nothing if they were another number.
  static std::optional<Cuts> blocks_of(const CheckpointSource& from, const Comm& comm);

  // One step of at most step_size(). Throws Stop(not_converged) on all ranks alike.
  void step();

  const Decomposition& decomposition() const { return decomposition_; }
  std::uint64_t steps() const { return steps_; }
  double time() const { return time_; }  // s
  bool finished() const;
  double step_size() const { return controller_.size(); }          // s
  double last_step() const { return last_step_; }                  // s, taken
  int last_substeps() const { return last_substeps_; }             // of the last step
  std::int64_t particle_count() const { return particle_count_; }  // all ranks
  const Turnover& turnover() const { return turnover_; }           // of particles, since time 0
  const Insertion* insertion() const { return insertion_.get(); }  // null: nothing enters
  std::vector<SizeMoments> size_moments() const;                   // of the particles that there are, a type; collective
  const GasOutcome& gas_outcome() const { return gas_outcome_; }
  GasBalance gas_balance() const { return gas_->solver.balance(); }  // of the last step; with gas only
  const Failure& failure() const;                                    // of this rank, to be voted on
  std::vector<std::string> take_notes();                             // changes of the step size, for the event log

  Observation observation();

  // This rank's part of the gas at cell centres, for plot files.
  struct GasPlot {
    GridPart part;
    std::vector<double> pressure, fraction;  // Pa, 1
    std::vector<Vec3> velocity;              // m/s
  };
  GasPlot gas_plot() const;
  const Dem* particles() const { return dem_.get(); }
  const Grid* grid() const { return gas_ ? &gas_->grid : nullptr; }

 private:
  struct GasPart {
    Grid grid;
    Halo halo;
    GasState state;
    GasSolver solver;
    GasPart(const Decomposition& decomposition, const Plan& plan, PhaseTimer& timer);
  };
  struct CouplingPart {
    Exchange exchange;
    Transfer transfer;
    Field fraction_before;
    CouplingPart(const Decomposition& decomposition, const Plan& plan, GasPart& gas, PhaseTimer& timer);
  };

  void look_for_particles();
  void deposit_volume();
  void find_drag();
  void deposit_drag(double dt);
  void pull_anew();
  int substeps_in(double dt) const;
  StepLimit step_limit() const;
  double advance_gas(double dt);
  void note(const std::string& change);
  void advance_particles(double dt);
  void turn_over_particles(double dt);
  void watch(double dt);
  Amount amount_here() const;
  Amount present() const;
  bool audit_due(double dt) const;
  void audit_exchange();
  void put_particles(CheckpointContent& content) const;
  void put_contacts(CheckpointContent& content) const;
  void put_turnover(CheckpointContent& content) const;
  void restore_turnover(const CheckpointSource& from);
  void begin_gas();
  void begin_particles(ParticleStore particles, std::int64_t next_id);
  static void require_same(const CheckpointSource& from, const std::string& name, const std::string& field, double here);
  void require_same_box(const CheckpointSource& from) const;
  void require_same_particles(const CheckpointSource& from) const;
  ParticleStore particles_of(const CheckpointSource& from) const;
  void restore_gas(const CheckpointSource& from);
  void restore_particles(const CheckpointSource& from);

  Plan plan_;
  PhaseTimer& timer_;
  Decomposition decomposition_;
  std::unique_ptr<GasPart> gas_;  // null: the scene has none of it
  std::unique_ptr<Dem> dem_;
  std::unique_ptr<Insertion> insertion_;
  std::unique_ptr<CouplingPart> coupling_;

  std::uint64_t steps_ = 0;
  bool coupled_ = false;  // in the present step there is something to pass between gas and particles
  int steps_alone_ = 0;   // since particles were last there, up to 2
  int last_substeps_ = 0;
  StepController controller_;
  double time_ = 0, last_step_ = 0, settled_time_ = 0;
  double max_overlap_ = 0;
  std::vector<WallLoad> wall_loads_;                                 // of the last step
  double audit_interval_ = std::numeric_limits<double>::infinity();  // the shortest of the monitors that ask for it, s
  double exchange_residual_ = 0;
  std::int64_t particle_count_ = 0, next_id_ = 0;
  Turnover turnover_;
  GasOutcome gas_outcome_;
  Failure failure_;  // that the guard has found
  EnergyWatch energy_;
  std::vector<std::string> notes_;
};

}  // namespace bedflow
