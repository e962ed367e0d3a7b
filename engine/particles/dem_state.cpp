// The state of the particles: set, restored, told.
#include <unordered_map>
#include <utility>

#include "particles/dem.h"
#include "particles/migration.h"

namespace bedflow {

void Dem::set_particles(ParticleStore particles) {
  restore(std::move(particles), {}, {}, {});
}

void Dem::restore(ParticleStore particles, const std::vector<Vec3>& positions_at_rebuild, const std::vector<PairHistory>& pairs,
                  const std::vector<WallHistory>& walls) {
  const PhaseTimer::Scope scope(timer_, Phase::pairs, particles.owned);
  const Comm& comm = decomposition_.comm();
  particles_ = std::move(particles);
  drop_ghosts();
  if (!setup_.rotation)
    for (std::size_t i = 0; i < particles_.owned; ++i) particles_.set_spin(i, {});
  const bool fresh = !comm.any(!positions_at_rebuild.empty());
  place_ = fresh ? particles_.positions() : positions_at_rebuild;
  failure_ = {};
  contacts_ = 0;
  look_for_lost(0);
  stopped_ = comm.any(static_cast<bool>(failure_));
  if (stopped_) return;

  history_.clear(particles_.owned);
  if (setup_.history || setup_.rolling_history) {
    std::vector<PairHistory> pairs_here = pairs;
    std::vector<WallHistory> walls_here = walls;
    redistribute(comm, particles_.id, pairs_here, walls_here);
    std::unordered_map<std::int64_t, std::size_t> row;
    for (std::size_t i = 0; i < particles_.owned; ++i) row[particles_.id[i]] = i;
    for (const PairHistory& pair : pairs_here) {
      if (const auto low = row.find(pair.low); low != row.end()) history_.add(low->second, pair.high, pair.memory);
      if (const auto high = row.find(pair.high); high != row.end()) history_.add(high->second, pair.low, -pair.memory);
    }
    for (const WallHistory& wall : walls_here)
      history_.add(row.at(wall.id), ContactHistory::wall_contact(wall.wall), wall.memory);
  }
  if (fresh) {
    migrate(decomposition_, setup_, particles_, history_);
    place_ = particles_.positions();
  }
  build_list();
}

void Dem::enter(const std::vector<Newcomer>& newcomers) {
  if (newcomers.empty() || stopped_) return;
  for (const Newcomer& newcomer : newcomers)
    if (decomposition_.owner(newcomer.position) == decomposition_.comm().rank()) newcomers_.push_back(newcomer);
  rebuild();
}

std::vector<Vec3> Dem::positions_at_rebuild() const {
  return {place_.begin(), place_.begin() + static_cast<std::ptrdiff_t>(particles_.owned)};
}

std::vector<PairHistory> Dem::pair_histories() const {
  std::vector<PairHistory> result;
  list_.each_pair_memory(now_, [&](std::size_t p, const ContactMemory& memory) {
    const auto [first, second] = list_.pairs[p];
    if (first >= particles_.owned) return;
    const std::int64_t a = particles_.id[first], b = particles_.id[second];
    result.push_back(a < b ? PairHistory{a, b, memory} : PairHistory{b, a, -memory});
  });
  return result;
}

std::vector<WallHistory> Dem::wall_histories() const {
  std::vector<WallHistory> result;
  list_.each_wall_memory(now_, [&](std::size_t w, const ContactMemory& memory) {
    result.push_back({particles_.id[list_.near[w].particle], list_.near[w].face, memory});
  });
  const std::vector<WallHistory> of_walls = walls_.histories(particles_, now_);
  result.insert(result.end(), of_walls.begin(), of_walls.end());
  return result;
}

std::vector<WallLoad> Dem::take_wall_loads() {
  std::vector<WallLoad> result(loads_.size());
  result.swap(loads_);
  for (WallLoad& load : result) {
    load.force *= 1.0 / std::max(loaded_, 1);
    load.torque *= 1.0 / std::max(loaded_, 1);
  }
  loaded_ = 0;
  return result;
}

std::vector<int> Dem::listed_pairs() const {
  std::vector<int> count(particles_.rows.size());
  for (std::size_t p = 0; p < list_.count(); ++p) ++count[list_.pairs[p].first], ++count[list_.pairs[p].second];
  count.resize(particles_.owned);
  return count;
}

Dem::DeepContact Dem::deepest_contact() const {
  DeepContact found;
  const auto radius = [&](std::size_t row) { return radius_of(setup_.types, particles_, row); };
  const auto place = [&](std::size_t row) {
    return particles_.position(row) + (row < particles_.owned ? Vec3{} : ghosts_.shifts()[row - particles_.owned]);
  };
  for (std::size_t p = 0; p < list_.count(); ++p) {
    const auto [i, j] = list_.pairs[p];
    const double sum = radius(i) + radius(j), overlap = 1 - norm(place(j) - place(i)) / sum;
    if (overlap > found.overlap) found = {overlap, particles_.id[i], particles_.id[j], place(i)};
  }
  for (const auto [i, face] : list_.near) {
    if (setup_.sides[face / 2][face % 2] != Side::wall) continue;
    const double overlap = (1 - faces_[face].distance(place(i)) / radius(i)) / 2;
    if (overlap > found.overlap) found = {overlap, particles_.id[i], -1, place(i)};
  }
  return found;
}

double Dem::take_max_overlap() {
  return std::exchange(deepest_, 0);
}

// After the contacts of a sub-step have been found, before it moves anything.
void Dem::open_account() {
  opening_ = false;
  const Bodies bodies{
      particles_.rows.data(), particles_.spin_z.data(), particles_.owned, force_.data(), ghosts_.shifts().data(), 0, now_};
  const ContactEnergy held = contact_energy(list_, faces_, walls_, setup_, particles_, bodies, laws_);
  const double created = energy_.given + held.stored + held.bound - energy_.stored - energy_.bound;
  energy_ = {0, held.stored, held.bound, opened_ ? created : 0};
  opened_ = true;
}

double Dem::kinetic_energy() const {
  double energy = 0;
  for (std::size_t i = 0; i < particles_.owned; ++i) {
    const double mass = mass_of(setup_.types, particles_, i), inertia = inertia_of(mass, radius_of(setup_.types, particles_, i));
    const Vec3 v = particles_.velocity(i), spin = particles_.spin(i);
    energy += 0.5 * (mass * dot(v, v) + inertia * dot(spin, spin));
  }
  return energy;
}

}  // namespace bedflow
