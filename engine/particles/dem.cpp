#include "particles/dem.h"

#include <cmath>
#include <sstream>
#include <unordered_map>

#include "base/check.h"
#include "particles/integrate.h"
#include "particles/migration.h"

namespace bedflow {

namespace {

template <class T>
void reorder(std::vector<T>& rows, const std::vector<std::uint32_t>& order, std::vector<T>& scratch) {
  if (rows.empty()) return;
  scratch.resize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) scratch[i] = rows[order[i]];
  rows.swap(scratch);
}

bool finite(Vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

Dem::Dem(const Decomposition& decomposition, const DemSetup& setup, PhaseTimer& timer)
    : decomposition_(decomposition),
      setup_(setup),
      timer_(timer),
      faces_(box_faces(decomposition.size())),
      ghosts_(decomposition, reach()) {}

Bodies Dem::bodies() {
  return {particles_, force_.data(), torque_.data(), particles_.owned, ghosts_.shifts().data()};
}

// ---------------------------------------------------------------------------------------------------- state

void Dem::set_particles(ParticleStore particles) {
  restore(std::move(particles), {}, {}, {});
}

void Dem::restore(ParticleStore particles, std::vector<Vec3> positions_at_rebuild, const std::vector<PairHistory>& pairs,
                  const std::vector<WallHistory>& walls) {
  const PhaseTimer::Scope scope(timer_, Phase::pairs, particles.owned);
  const Comm& comm = decomposition_.comm();
  particles_ = std::move(particles);
  drop_ghosts();
  if (!setup_.rotation)
    for (std::size_t i = 0; i < particles_.owned; ++i) particles_.set_spin(i, {});
  const bool fresh = !comm.any(!positions_at_rebuild.empty());
  place_ = fresh ? particles_.positions() : std::move(positions_at_rebuild);
  failure_ = {};
  contacts_ = 0;
  look_for_lost(0);
  stopped_ = comm.any(static_cast<bool>(failure_));
  if (stopped_) return;

  history_.clear(particles_.owned);
  if (setup_.history) {
    std::vector<PairHistory> pairs_here = pairs;
    std::vector<WallHistory> walls_here = walls;
    redistribute(comm, particles_.id, pairs_here, walls_here);
    std::unordered_map<std::int64_t, std::size_t> row;
    for (std::size_t i = 0; i < particles_.owned; ++i) row[particles_.id[i]] = i;
    for (const PairHistory& pair : pairs_here) {
      if (const auto low = row.find(pair.low); low != row.end()) history_.add(low->second, pair.high, pair.displacement);
      if (const auto high = row.find(pair.high); high != row.end()) history_.add(high->second, pair.low, pair.displacement);
    }
    for (const WallHistory& wall : walls_here)
      history_.add(row.at(wall.id), ContactHistory::wall_contact(wall.wall), wall.displacement);
  }
  if (fresh) {
    migrate(decomposition_, setup_, particles_, history_);
    place_ = particles_.positions();
  }
  build_list();
}

std::vector<PairHistory> Dem::pair_histories() const {
  std::vector<PairHistory> result;
  for (std::size_t p = 0; p < list_.pair_history.size(); ++p) {
    const auto [low, high] = list_.pairs[p];
    if (low < particles_.owned && list_.pair_history[p] != Vec3{})
      result.push_back({particles_.id[low], particles_.id[high], list_.pair_history[p]});
  }
  return result;
}

std::vector<WallHistory> Dem::wall_histories() const {
  std::vector<WallHistory> result;
  for (std::size_t w = 0; w < list_.wall_history.size(); ++w)
    if (list_.wall_history[w] != Vec3{})
      result.push_back({particles_.id[list_.near[w].particle], list_.near[w].face, list_.wall_history[w]});
  return result;
}

double Dem::take_max_overlap() {
  const double result = max_overlap();
  deepest_ = 0;
  return result;
}

double Dem::kinetic_energy() const {
  double translation = 0, rotation = 0;
  for (std::size_t i = 0; i < particles_.owned; ++i) {
    translation += dot(particles_.velocity(i), particles_.velocity(i));
    rotation += dot(particles_.spin(i), particles_.spin(i));
  }
  return 0.5 * (setup_.mass * translation + setup_.inertia() * rotation);
}

// ---------------------------------------------------------------------------------------------------- pair list

void Dem::drop_ghosts() {
  particles_.resize(particles_.owned);
  particles_.gas_force.resize(setup_.gas != GasForce::none ? particles_.owned : 0);
  particles_.gas_response.resize(setup_.gas == GasForce::relaxed ? particles_.owned : 0);
}

void Dem::forward_ghosts() {
  constexpr std::size_t row = sizeof(ParticleRow) / sizeof(double);
  const GhostExchange::Column columns[] = {{&particles_.rows.data()->position.x, row, setup_.rotation ? row : 6},
                                           {particles_.spin_z.data(), 1, 1}};
  ghosts_.forward(std::span(columns).first(setup_.rotation ? 2 : 1));
}

void Dem::rebuild() {
  const PhaseTimer::Scope scope(timer_, Phase::pairs, particles_.owned);
  if (setup_.history) {
    list_.save(particles_, history_);
  } else {
    history_.clear(particles_.owned);
  }
  drop_ghosts();
  {
    const PhaseTimer::Scope migration(timer_, Phase::migration, particles_.owned);
    migrate(decomposition_, setup_, particles_, history_);
  }
  place_ = particles_.positions();
  build_list();
  ++rebuilds_;
}

// Sorts by the places at the rebuild, which leaves a stored order as it is, and builds the list from them.
void Dem::build_list() {
  cells_.sort(place_, reach());
  for (auto* vectors : {&particles_.gas_force, &place_}) reorder(*vectors, cells_.order(), scratch_);
  std::vector<ParticleRow> rows;
  std::vector<double> spins_z;
  std::vector<std::int64_t> ids;
  reorder(particles_.rows, cells_.order(), rows);
  reorder(particles_.spin_z, cells_.order(), spins_z);
  std::vector<std::int32_t> heads;
  reorder(particles_.id, cells_.order(), ids);
  reorder(history_.heads(), cells_.order(), heads);
  std::vector<GasResponse> responses;
  reorder(particles_.gas_response, cells_.order(), responses);

  all_places_ = place_;
  {
    const PhaseTimer::Scope scope(timer_, Phase::migration, particles_.owned);
    ghosts_.choose(all_places_, particles_.id);
    particles_.rows.resize(all_places_.size());
    particles_.spin_z.resize(all_places_.size());
    forward_ghosts();
  }
  list_.build(cells_, setup_, faces_, particles_, all_places_, ghosts_.shifts());
  if (setup_.history) list_.load(particles_, history_);
  touching_.resize(list_.pairs.size());
  force_.assign(particles_.owned, {});
  torque_.assign(setup_.rotation ? particles_.owned : 0, {});
}

// Rebuilds the list on all ranks when a particle of any has moved half a skin; else the ghosts follow their owners.
void Dem::keep_list_valid(bool far, double dt) {
  enum : std::int64_t { valid, outdated, failed } status = far ? outdated : valid;
  if (far) look_for_lost(dt);
  if (failure_) status = failed;
  std::int64_t agreed = status;
  {
    const PhaseTimer::Scope scope(timer_, Phase::migration, particles_.owned);
    agreed = decomposition_.comm().max(agreed);
    if (agreed == valid) forward_ghosts();
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
    if (side == Side::periodic || faces_[face].distance(x) >= 0) continue;
    std::ostringstream what;
    what << (side == Side::wall ? "passed the wall " : "left through the open face ") << "xyz"[face / 2]
         << (face % 2 == 0 ? "_low" : "_high")
         << (side == Side::wall ? " (a stiffer contact or more particles.steps_per_collision would hold it)"
                                : " (a larger domain.size would keep it, or outflow { screen: true } on that face)");
    return say(Reason::particle_lost, what.str());
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

template <class Contact, class Tangential>
void Dem::advance(int substeps, double dt, const PairAndWall<Contact>& contact, const PairAndWall<Tangential>& tangential) {
  CHECK(setup_.rotation || !Tangential::rotation);
  CHECK(setup_.history || !Tangential::history);
  constexpr bool rotation = Tangential::rotation, history = Tangential::history;
  const double radius = setup_.radius, mass = setup_.mass;
  for (int substep = 0; substep < substeps && !stopped_; ++substep) {
    const std::size_t count = particles_.owned;
    const Bodies rows = bodies();
    {
      const PhaseTimer::Scope scope(timer_, Phase::contacts, count);
      const auto sweep = [&]<bool with_ghost>(std::size_t first, std::size_t last) {
        const std::size_t n = find_touching<with_ghost, history>(list_, first, last, rows, 2 * radius, touching_.data());
        deepest_ = std::max(
            deepest_, sweep_pairs<with_ghost>(list_, touching_.data(), n, rows, contact.pair, tangential.pair, radius, mass, dt));
        return n;
      };
      contacts_ = static_cast<std::int64_t>(sweep.template operator()<false>(0, list_.across));
      const std::size_t across = sweep.template operator()<true>(list_.across, list_.pairs.size());
      for (std::size_t c = 0; c < across; ++c) contacts_ += list_.pairs[touching_[c]].low < count;
    }
    {
      const PhaseTimer::Scope scope(timer_, Phase::walls, count);
      const WallSweep walls = sweep_walls(list_, faces_, setup_, rows, contact.wall, tangential.wall, dt);
      deepest_ = std::max(deepest_, walls.deepest);
      if (walls.passed) look_for_lost(dt);
    }
    bool far = false;
    {
      const PhaseTimer::Scope scope(timer_, Phase::integration, count);
      const double limit = 0.5 * setup_.skin;
      const auto advance = [&]<GasForce gas> {
        return integrate<rotation, gas>(setup_, particles_, force_, torque_, place_, limit, dt);
      };
      far = setup_.gas == GasForce::none     ? advance.template operator()<GasForce::none>()
            : setup_.gas == GasForce::frozen ? advance.template operator()<GasForce::frozen>()
                                             : advance.template operator()<GasForce::relaxed>();
    }
    keep_list_valid(far, dt);
  }
}

template void Dem::advance(int, double, const PairAndWall<LinearSpringDashpot>&, const PairAndWall<Frictionless>&);
template void Dem::advance(int, double, const PairAndWall<LinearSpringDashpot>&, const PairAndWall<Coulomb>&);
template void Dem::advance(int, double, const PairAndWall<LinearSpringDashpot>&, const PairAndWall<TangentialSpring>&);

}  // namespace bedflow
