#include "simulation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/short_number.h"
#include "guard.h"

namespace bedflow {

namespace {

DemSetup dem_setup(const Plan& plan) {
  const ParticleScene& particles = *plan.scene.particles;
  DemSetup setup;
  setup.types = particles.types;
  setup.gravity = plan.scene.gravity;
  setup.skin = plan.skin;
  setup.widest_skin = plan.tuned_skin ? plan.skin : 0;
  setup.verlet = particles.verlet;
  setup.sides = plan.scene.sides;
  if (plan.scene.coupling) {
    setup.gas = std::visit([](const auto& scheme) { return scheme.relaxes ? GasForce::relaxed : GasForce::frozen; },
                           plan.scene.coupling->scheme);
  }
  return setup;
}

}  // namespace

// ------------------------------------------------------------------------------------------------ parts

Simulation::GasPart::GasPart(const Decomposition& decomposition, const Plan& plan, PhaseTimer& timer)
    : grid(decomposition, plan.ghosts),
      halo(decomposition, grid, timer),
      state(grid),
      solver(decomposition, grid, halo, plan.scene.gas->setup, timer) {}

Simulation::CouplingPart::CouplingPart(const Decomposition& decomposition, const Plan& plan, GasPart& gas, PhaseTimer& timer)
    : exchange(gas.grid),
      transfer(decomposition, gas.grid, gas.halo,
               {.kernel = plan.scene.coupling->kernel,
                .diameter = plan.scene.particles->largest(),
                .particle_volume = sphere_volume(plan.scene.particles->largest()),
                .mass = plan.scene.particles->types.front().mass(),
                .gravity = plan.scene.gravity,
                .fraction_floor = plan.scene.coupling->fraction_floor,
                .scheme = plan.scene.coupling->scheme,
                .coarse_graining = plan.scene.particles->coarse_graining,
                .types = plan.scene.particles->types,
                .panels = plan.scene.gas->setup.panels},
               timer),
      fraction_before(gas.grid) {}

Simulation::Simulation(const Plan& plan, const Comm& comm, PhaseTimer& timer, Cuts cuts)
    : plan_(plan),
      timer_(timer),
      decomposition_(comm, plan.scene.size, plan.scene.periodic, std::move(cuts)),
      controller_(plan),
      energy_(plan.scene.guard.energy) {
  if (plan.scene.gas) gas_ = std::make_unique<GasPart>(decomposition_, plan_, timer_);
  if (plan.scene.particles) {
    dem_ = std::make_unique<Dem>(decomposition_, dem_setup(plan_), plan.scene.particles->laws, timer_, plan.scene.walls);
  }
  if (plan.scene.particles && !plan.scene.particles->inlets.empty()) {
    const ParticleScene& particles = *plan_.scene.particles;
    insertion_ = std::make_unique<Insertion>(decomposition_, dem_->setup(), particles.kinds, particles.inlets);
  }
  if (plan.scene.coupling) coupling_ = std::make_unique<CouplingPart>(decomposition_, plan_, *gas_, timer_);
  for (const MonitorSetup& monitor : plan.scene.monitors) {
    if (!coupling_ || !std::holds_alternative<MomentumBalance>(monitor.statistic)) continue;
    audit_interval_ = std::min(audit_interval_, monitor.interval);
  }
}

// ------------------------------------------------------------------------------------------------ one step

void Simulation::step() {
  look_for_particles();            // coupled_
  if (coupled_) deposit_volume();  // particles -> ε, ∂ε/∂t
  if (coupled_) find_drag();       // U, ε -> b
  if (gas_) note(controller_.hold(step_limit(), time_));
  double dt = controller_.next(time_);
  if (coupled_) deposit_drag(dt);                                            // b and bV -> faces
  if (gas_) dt = advance_gas(dt);                                            // U, p
  if (coupled_) coupling_->transfer.sample(gas_->state, dem_->particles());  // U, ∇p -> F_g
  if (audit_due(dt)) audit_exchange();
  if (dem_) advance_particles(dt);  // contacts, walls, motion, in sub-steps
  time_ = controller_.end(time_, dt);
  if (dem_) turn_over_particles(dt);  // some have entered, some have left
  last_step_ = dt;
  ++steps_;
  watch(dt);  // is it still a bed?
}

void Simulation::watch(double dt) {
  const GuardSetup& limits = plan_.scene.guard;
  if (coupling_) watch_fraction(limits, gas_->grid, coupling_->transfer.lowest(), failure_);
  if (gas_) watch_gas(limits, gas_->grid, gas_->state.velocity, dt, failure_);
  if (dem_) energy_.look(*dem_, decomposition_.comm(), failure_);
  if (dem_) watch_particles(limits, *dem_, max_overlap_, dt / last_substeps_, failure_);
}

// As long as there are particles, and for two steps after: the first takes them out of ε and of the exchange, the second out of
// ∂ε/∂t. Then nothing of either changes any more until one enters.
void Simulation::look_for_particles() {
  if (!coupling_) return;
  coupled_ = particle_count_ > 0 || steps_alone_ < 2;
  steps_alone_ = particle_count_ > 0 ? 0 : std::min(steps_alone_ + 1, 2);
}

void Simulation::deposit_volume() {
  GasState& gas = gas_->state;
  std::swap(coupling_->fraction_before, gas.fraction);
  coupling_->transfer.deposit_volume(dem_->particles(), gas.fraction);
  if (!plan_.scene.coupling->displacement || last_step_ == 0) return;
  const double rate = 1 / last_step_;  // the time in which the particles moved
  for (std::size_t c = 0; c < gas.fraction.size(); ++c) {
    gas.fraction_rate.data()[c] = rate * (gas.fraction.data()[c] - coupling_->fraction_before.data()[c]);
  }
}

void Simulation::find_drag() {
  const ParticleScene& particles = *plan_.scene.particles;
  const DragScene scene{plan_.scene.gas->setup.density, plan_.scene.gas->setup.viscosity,
                        particles.largest() / particles.coarse_graining};
  std::visit([&](const auto& law) { coupling_->transfer.find_drag(law, scene, dem_->particles(), gas_->state); },
             plan_.scene.coupling->drag);
}

void Simulation::deposit_drag(double dt) {
  coupling_->transfer.deposit_drag(dem_->particles(), {dt, substeps_in(dt)}, coupling_->exchange);
}

int Simulation::substeps_in(double dt) const {
  return std::max(1, static_cast<int>(std::ceil(dt / plan_.substep - 1e-9)));
}

// Of the state that a step starts from: the Courant number; and half of 2m/b, beyond which frozen drag is unstable, where the
// step may grow at all (the plan has seen to time.step). Collective.
StepLimit Simulation::step_limit() const {
  StepLimit limit;
  const Scene& scene = plan_.scene;
  if (scene.courant) {
    const double rate = decomposition_.comm().max(fastest_transport(gas_->grid, gas_->state.velocity));
    if (rate > 0) {
      limit = {*scene.courant / rate, "the Courant number must stay below time.courant = " + short_number(*scene.courant)};
    }
  }
  if (coupling_ && std::holds_alternative<Explicit>(scene.coupling->scheme) && plan_.longest_step > plan_.step) {
    const double rate = decomposition_.comm().max(coupling_->transfer.fastest_response()), most = 1 / rate;
    if (rate > 0 && most < limit.longest) limit = {most, "the drag of the particles allows m/b = " + short_number(most) + " s"};
  }
  return limit;
}

// Takes the longest step up to dt that converges; returns it.
double Simulation::advance_gas(double dt) {
  const Exchange* exchange = coupled_ ? &coupling_->exchange : nullptr;
  for (;;) {
    gas_outcome_ = gas_->solver.advance(gas_->state, exchange, time_, dt);
    if (gas_outcome_.converged) break;
    note(controller_.cut(dt, time_, gas_outcome_.reason));
    if (coupled_) deposit_drag(dt);  // what the gas is to lose depends on the step
  }
  note(controller_.converged());
  return dt;
}

void Simulation::note(const std::string& change) {
  if (!change.empty()) notes_.push_back("step " + std::to_string(steps_ + 1) + ": " + change);
}

// In the steps after which a monitor takes a sample (statistics/monitors.h), the first and the last.
bool Simulation::audit_due(double dt) const {
  if (!std::isfinite(audit_interval_)) return false;
  if (steps_ == 0 || audit_interval_ <= 0 || time_ + dt >= plan_.scene.end_time - 1e-3 * dt) return true;
  return std::floor((time_ + 1.001 * dt) / audit_interval_) > std::floor((time_ + 1e-3 * last_step_) / audit_interval_);
}

// What the gas lost less what the particles received, in the worst direction, over the sum of absolute values.
void Simulation::audit_exchange() {
  const ExchangeBalance balance = coupling_->transfer.balance(gas_->state, coupling_->exchange, dem_->particles());
  exchange_residual_ = 0;
  for (int d = 0; d < 3; ++d) {
    if (balance.scale[d] == 0) continue;
    const double residual = std::abs(balance.lost_by_gas[d] - balance.received_by_particles[d]) / balance.scale[d];
    exchange_residual_ = std::max(exchange_residual_, residual);
  }
}

void Simulation::advance_particles(double dt) {
  const int substeps = substeps_in(dt);
  energy_.prepare(*dem_);
  if (coupled_ && std::visit([](const auto& scheme) { return scheme.anew; }, plan_.scene.coupling->scheme)) {
    for (int substep = 0; substep < substeps; ++substep) {
      pull_anew();
      dem_->advance(1, dt / substeps, time_ + substep * (dt / substeps));
    }
  } else {
    dem_->advance(substeps, dt / substeps, time_);
  }
  wall_loads_ = dem_->take_wall_loads();
  last_substeps_ = substeps;
  max_overlap_ = dem_->take_max_overlap();
}

void Simulation::pull_anew() {
  coupling_->transfer.locate(dem_->particles());
  find_drag();
  coupling_->transfer.pull(dem_->particles());
}

bool Simulation::finished() const {
  return time_ >= plan_.scene.end_time - 1e-9 * plan_.step;
}

const Failure& Simulation::failure() const {
  return dem_ && dem_->failure() ? dem_->failure() : failure_;
}

std::vector<std::string> Simulation::take_notes() {
  return std::exchange(notes_, {});
}

// ------------------------------------------------------------------------------------------------ begin

void Simulation::seed() {
  begin_gas();
  if (dem_) {
    const ParticleScene& particles = *plan_.scene.particles;
    const std::vector<PlacedSphere> spheres = seed_spheres(particles.kinds, particles.regions);
    begin_particles(keep_owned(decomposition_, dem_->setup(), spheres), static_cast<std::int64_t>(spheres.size()));
  }
  if (coupling_) coupling_->transfer.deposit_volume(dem_->particles(), gas_->state.fraction);
}

void Simulation::begin_gas() {
  if (!gas_) return;
  GasState& gas = gas_->state;
  for (int d = 0; d < 3; ++d) gas.velocity[d].fill(plan_.scene.gas->initial_velocity[d]);
  gas_->solver.prepare(gas, 0);
}

void Simulation::begin_particles(ParticleStore particles, std::int64_t next_id) {
  dem_->set_particles(std::move(particles));
  next_id_ = next_id;
  turnover_.initial = present();
  particle_count_ = turnover_.initial.count;
}

bool Simulation::settle() {
  if (!dem_ || !plan_.scene.particles->settling || particle_count_ == 0) return false;
  const Settling& settling = *plan_.scene.particles->settling;
  constexpr int substeps = 100;
  ContactLaws settling_laws = plan_.scene.particles->laws;
  settling_laws.contact = settling.contact;
  dem_->use(settling_laws);
  dem_->advance(substeps, plan_.substep);
  dem_->use(plan_.scene.particles->laws);
  settled_time_ += substeps * plan_.substep;
  dem_->take_max_overlap();
  dem_->take_wall_loads();
  energy_.begin();
  // Not before the highest has had the time to fall: at the start all are slow.
  const double energy = decomposition_.comm().sum(dem_->kinetic_energy());
  const double speed = std::sqrt(2 * energy / turnover_.initial.mass);
  if (settled_time_ < settling.duration && (settled_time_ < plan_.fall_time || speed > settling.rest_velocity)) return true;
  if (coupling_) coupling_->transfer.deposit_volume(dem_->particles(), gas_->state.fraction);
  for (GasResponse& response : dem_->particles().gas_response) response = {};  // no gas has been felt
  return false;
}

// ------------------------------------------------------------------------------------------------ observe

Observation Simulation::observation() {
  Observation now{.decomposition = decomposition_};
  if (gas_) {
    now.grid = &gas_->grid;
    now.pressure = &gas_->state.pressure;
    now.pressure_fall = gas_->state.fall.y;
    now.fraction = &gas_->state.fraction;
    const GasBalance balance = gas_->solver.balance();
    const double through = std::max({std::abs(balance.in), std::abs(balance.out), std::abs(balance.storage)});
    now.mass_residual = steps_ > 0 && through > 0 ? (balance.in - balance.out - balance.storage) / through : 0;
  }
  now.momentum_residual = exchange_residual_;
  if (dem_) {
    now.particles = &dem_->particles();
    now.types = &dem_->setup().types;
    now.mass_entered = turnover_.entered.mass;
    now.mass_left = turnover_.left.mass;
    now.max_overlap = max_overlap_;
    now.wall_loads = wall_loads_;
  }
  return now;
}

Simulation::GasPlot Simulation::gas_plot() const {
  const Grid& grid = gas_->grid;
  const GasState& gas = gas_->state;
  GasPlot plot{{grid.global, grid.first, grid.cells}, {}, {}, {}};
  for (int k = 0; k < grid.cells[2]; ++k)
    for (int j = 0; j < grid.cells[1]; ++j)
      for (int i = 0; i < grid.cells[0]; ++i) {
        const Vec3 centre = grid.low + Vec3{(i + 0.5) * grid.spacing.x, (j + 0.5) * grid.spacing.y, (k + 0.5) * grid.spacing.z};
        plot.pressure.push_back(gas.pressure(i, j, k) - dot(gas.fall, centre));
        plot.fraction.push_back(gas.fraction(i, j, k));
        Vec3& velocity = plot.velocity.emplace_back();
        for (int d = 0; d < 3; ++d) {
          const double upper = gas.velocity[d](i + (d == 0), j + (d == 1), k + (d == 2));
          velocity[d] = 0.5 * (gas.velocity[d](i, j, k) + upper);
        }
      }
  return plot;
}

}  // namespace bedflow
