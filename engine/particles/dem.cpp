#include "particles/dem.h"

#include <cmath>
#include <sstream>
#include <utility>

#include "base/check.h"
#include "particles/integrate.h"
#include "particles/migration.h"
#include "particles/outflow.h"

namespace bedflow {

namespace {

// Calls run with the values as constants.
template <class Run, bool... known>
void with_constants(Run run, std::integer_sequence<bool, known...> constants) {
  run(constants);
}
template <class Run, bool... known, class... Rest>
void with_constants(Run run, std::integer_sequence<bool, known...>, bool next, Rest... rest) {
  if (next) {
    with_constants(run, std::integer_sequence<bool, known..., true>{}, rest...);
  } else {
    with_constants(run, std::integer_sequence<bool, known..., false>{}, rest...);
  }
}

bool finite(Vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

DemSetup required(DemSetup setup, const ContactLaws& laws) {
  setup.rotation = laws.rotation();
  setup.history = laws.history();
  setup.rolling_history = laws.rolling_history();
  setup.range = laws.range();
  return setup;
}

}  // namespace

Dem::Dem(const Decomposition& decomposition, const DemSetup& setup, ContactLaws laws, PhaseTimer& timer, std::vector<Wall> walls)
    : decomposition_(decomposition),
      setup_(required(setup, laws)),
      laws_(std::move(laws)),
      timer_(timer),
      faces_(box_faces(decomposition.size())),
      ghosts_(decomposition, reach_with(std::max(setup.skin, setup.widest_skin))),
      cells_(setup.types.size()),
      tuner_(2 * setup.largest_radius(), setup.widest_skin),
      walls_(std::move(walls), decomposition.size(), reach_with(std::max(setup.skin, setup.widest_skin))),
      loads_(faces_.size() + walls_.size()),
      history_(setup_.rolling_history) {
  ghosts_.set_reach(reach());
}

void Dem::use(ContactLaws laws) {
  CHECK(laws.history() <= setup_.history && laws.rolling_history() <= setup_.rolling_history && laws.range() <= setup_.range);
  laws_ = std::move(laws);
}

// ---------------------------------------------------------------------------------------------------- pair list

// An array that was not given is filled: gas forces with 0, types with the first, radii with the type's.
void Dem::drop_ghosts() {
  const std::size_t given = particles_.radius.size();
  particles_.each_array(setup_, [&](auto& array) { array.resize(particles_.owned); });
  if (setup_.gas == GasForce::none) particles_.gas_force.clear();
  if (setup_.gas != GasForce::relaxed) particles_.gas_response.clear();
  if (setup_.distributed())
    for (std::size_t i = given; i < particles_.owned; ++i) particles_.radius[i] = type_of(setup_.types, particles_, i).radius;
}

// Chooses the ghosts anew, by the places of the owned particles.
void Dem::take_ghosts() {
  const PhaseTimer::Scope scope(timer_, Phase::migration, particles_.owned);
  place_.resize(particles_.owned);
  ghosts_.choose(place_, particles_.id);
  const std::size_t all = place_.size();
  particles_.rows.resize(all);
  particles_.spin_z.resize(all);
  forward_ghosts();
  if (setup_.types.size() > 1) {
    std::vector<double> types(particles_.type.begin(), particles_.type.end());
    types.resize(all);
    ghosts_.forward({{{types.data(), 1, 1}}});
    particles_.type.resize(all);
    for (std::size_t i = particles_.owned; i < all; ++i) particles_.type[i] = static_cast<std::uint8_t>(types[i]);
  }
  if (setup_.distributed()) {
    particles_.radius.resize(all);
    ghosts_.forward({{{particles_.radius.data(), 1, 1}}});
  }
}

void Dem::forward_ghosts() {
  constexpr std::size_t row = sizeof(ParticleRow) / sizeof(double);
  double* first = particles_.rows.empty() ? nullptr : &particles_.rows.front().position.x;
  const GhostExchange::Column columns[] = {{first, row, setup_.rotation ? row : 6}, {particles_.spin_z.data(), 1, 1}};
  ghosts_.forward(std::span(columns).first(setup_.rotation ? 2 : 1));
}

void Dem::set_tuning(const Tuning& tuning) {
  setup_.skin = tuning.skin;
  tuner_.counts = tuning.counts;
  ghosts_.set_reach(reach());
}

// By what all ranks have counted.
void Dem::tune_skin() {
  const Comm& comm = decomposition_.comm();
  const auto particles = static_cast<double>(comm.sum(static_cast<std::int64_t>(particles_.owned)));
  const auto pairs = static_cast<double>(comm.sum(static_cast<std::int64_t>(list_.count())));
  if (particles > 0) set_tuning({tuner_.choose(setup_.skin, pairs / particles), {}});
}

void Dem::rebuild() {
  const PhaseTimer::Scope scope(timer_, Phase::pairs, particles_.owned);
  ++tuner_.counts.rebuilds;
  if (tuner_.due()) tune_skin();
  list_.save(particles_, now_, history_);
  walls_.save(now_, history_);
  drop_ghosts();
  const Departed gone = take_departed_particles(decomposition_.size(), setup_, particles_, history_);
  departed_.amount.count += gone.amount.count;
  departed_.amount.mass += gone.amount.mass;
  departed_.momentum += gone.momentum;
  departed_.debt += gone.debt;
  for (const Newcomer& n : newcomers_) {
    particles_.add(setup_, n.id, n.position, n.velocity, {}, n.type, n.radius);
    history_.append_particle();
  }
  newcomers_.clear();
  particles_.each_array(setup_, [&](auto& array) { array.resize(particles_.owned); });
  {
    const PhaseTimer::Scope migration(timer_, Phase::migration, particles_.owned);
    migrate(decomposition_, setup_, particles_, history_);
  }
  place_.clear();
  for (std::size_t i = 0; i < particles_.owned; ++i) place_.push_back(particles_.position(i));
  build_list();
  ++rebuilds_;
}

// By type, and in space by the places at the rebuild, which leaves a stored order as it is.
void Dem::sort() {
  const auto edge = [&](std::size_t type) { return 2 * setup_.types[type].radius + setup_.range + setup_.skin; };
  std::vector<std::uint32_t>& order = reorder_.order;
  if (setup_.types.size() == 1) {
    cells_[0].sort(place_, edge(0));
    order = cells_[0].order();
  } else {
    std::vector<std::vector<std::uint32_t>> members(setup_.types.size());
    for (std::size_t i = 0; i < particles_.owned; ++i) members[particles_.type[i]].push_back(static_cast<std::uint32_t>(i));
    order.clear();
    std::vector<Vec3> places;
    for (std::size_t type = 0; type < members.size(); ++type) {
      places.clear();
      for (const std::uint32_t i : members[type]) places.push_back(place_[i]);
      cells_[type].sort(places, edge(type), static_cast<std::uint32_t>(order.size()));
      for (const std::uint32_t k : cells_[type].order()) order.push_back(members[type][k]);
    }
  }
  particles_.each_array(setup_, [&](auto& array) { reorder_(array); });
  reorder_(place_);
  reorder_(history_.heads());
}

void Dem::build_list() {
  sort();
  take_ghosts();
  list_.build(cells_, setup_, faces_, particles_, place_, ghosts_.shifts());
  list_.load(particles_, now_, history_);
  walls_.load(now_, history_, particles_.owned);
  force_.assign(particles_.owned, {});
  place_.push_back({});
}

// Rebuilds the list on all ranks when a particle of any has moved half a skin; else the ghosts follow their owners.
void Dem::keep_list_valid(bool far, double dt) {
  enum : std::int64_t { valid, outdated, failed } status = far ? outdated : valid;
  if (far) look_for_lost(dt);
  ++tuner_.counts.substeps;
  if (tuner_.due()) status = outdated;
  if (failure_) status = failed;
  std::int64_t agreed = valid;
  {
    const PhaseTimer::Scope scope(timer_, Phase::migration, particles_.owned);
    decomposition_.comm().begin_max(status);
    forward_ghosts();  // while the ranks agree; in vain when one of them says no
    agreed = decomposition_.comm().end_max();
  }
  if (agreed == outdated) rebuild();
  stopped_ = agreed == failed;
}

// ---------------------------------------------------------------------------------------------------- failures

void Dem::look_for_lost(double dt) {
  for (std::size_t i = 0; i < particles_.owned; ++i)
    if (judge(i, dt)) return;
}

// Whether the particle is lost; says why. Nothing else may rely on a particle that has moved further than half a skin and its
// diameter at once: it would jump over others, and over blocks.
bool Dem::judge(std::size_t row, double dt) {
  const Vec3 x = particles_.position(row), v = particles_.velocity(row);
  const auto say = [&](Reason reason, const std::string& what) {
    std::ostringstream message;
    message << "particle " << particles_.id[row] << " " << what << ": at (" << x.x << ", " << x.y << ", " << x.z
            << ") m, velocity (" << v.x << ", " << v.y << ", " << v.z << ") m/s";
    failure_.note(reason, message.str());
    return true;
  };
  if (!finite(x) || !finite(v)) return say(Reason::diverged, "is not finite; try more particles.steps_per_collision");
  for (int face = 0; face < 6; ++face) {
    const Side side = setup_.sides[face / 2][face % 2];
    if (side == Side::periodic || side == Side::outlet || faces_[face].distance(x) >= 0) continue;
    std::ostringstream what;
    what << (side == Side::wall ? "passed the wall " : "left through the open face ") << "xyz"[face / 2]
         << (face % 2 == 0 ? "_low" : "_high")
         << (side == Side::wall
                 ? " (a stiffer contact or more particles.steps_per_collision would hold it)"
                 : " (a larger domain.size or outflow { screen: true } on that face would keep it, outflow { particles: LEAVE } "
                   "would count it out)");
    return say(Reason::particle_lost, what.str());
  }
  if (const std::string* wall = walls_.passed(x)) {
    return say(Reason::particle_lost, "is on the wrong side of the wall " + *wall +
                                          " (a stiffer contact or more particles.steps_per_collision would hold it)");
  }
  const Vec3 moved = x - place_[row];
  if (norm(moved) > reach()) {
    std::ostringstream what;
    what << "moved further than its diameter in one sub-step of " << dt << " s; try more particles.steps_per_collision";
    return say(Reason::diverged, what.str());
  }
  return false;
}

// ---------------------------------------------------------------------------------------------------- sub-steps

void Dem::advance(int substeps, double dt, std::optional<double> time) {
  for (int substep = 0; substep < substeps && !stopped_; ++substep) {
    ++now_;
    const Bodies bodies{
        particles_.rows.data(), particles_.spin_z.data(), particles_.owned, force_.data(), ghosts_.shifts().data(), dt, now_};
    contacts(bodies);
    walls(bodies, time ? std::optional(*time + substep * dt) : std::nullopt);
    if (opening_) open_account();
    keep_list_valid(move(dt), dt);
  }
}

void Dem::contacts(const Bodies& bodies) {
  const PhaseTimer::Scope scope(timer_, Phase::contacts, particles_.owned);
  const SweepResult pairs = add_pair_forces(list_, setup_, particles_, bodies, laws_);
  deepest_ = std::max(deepest_, pairs.deepest);
  contacts_ = pairs.contacts;
  add_rolling_torques(list_, setup_, particles_, bodies, laws_);
  add_cohesion_forces(list_, setup_, particles_, bodies, laws_);
}

void Dem::walls(const Bodies& bodies, std::optional<double> time) {
  const PhaseTimer::Scope scope(timer_, Phase::walls, particles_.owned);
  WallResult result = add_face_forces(list_, faces_, setup_, particles_, bodies, laws_, loads_);
  if (walls_.size() > 0) {
    walls_.meet(setup_, particles_, std::span(place_).first(particles_.owned), time, now_);
    result.note(add_wall_forces(walls_, setup_, particles_, bodies, laws_, loads_));
    power_of_walls_ = walls_.take_power();
  }
  ++loaded_;
  deepest_ = std::max(deepest_, result.deepest);
  if (result.passed) look_for_lost(bodies.dt);
}

// Returns whether a particle is half a skin from its place at the rebuild.
bool Dem::move(double dt) {
  const PhaseTimer::Scope scope(timer_, Phase::integration, particles_.owned);
  bool far = false;
  energy_.given -= power_of_walls_ * dt;
  for (std::size_t type = 0; type < cells_.size(); ++type) {
    const auto with = [&]<GasForce gas>() {
      const auto run = [&]<bool... parts>(std::integer_sequence<bool, parts...>) {
        const Moved moved = integrate<gas, parts...>(setup_, setup_.types[type], cells_[type].first(), cells_[type].last(),
                                                     particles_, force_.data(), place_.data(), 0.5 * setup_.skin, dt);
        far |= moved.far;
        energy_.given += moved.work;
      };
      with_constants(run, std::integer_sequence<bool>{}, setup_.rotation, setup_.verlet, setup_.types[type].distributed);
    };
    switch (setup_.gas) {
      case GasForce::none:
        with.operator()<GasForce::none>();
        break;
      case GasForce::frozen:
        with.operator()<GasForce::frozen>();
        break;
      case GasForce::relaxed:
        with.operator()<GasForce::relaxed>();
    }
  }
  return far;
}

}  // namespace bedflow
