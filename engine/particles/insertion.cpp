#include "particles/insertion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/stop.h"

namespace bedflow {

namespace {

constexpr std::size_t tries_a_step = 16;  // of a particle that is due
constexpr double densest_layer = 0.547;   // of a patch that spheres at random cover at most (Feder 1980)

// Number `n` of the sequence of a seed, uniform in [0, 1): a counter in place of a state (SplitMix64, Steele et al. 2014).
double uniform(std::uint64_t seed, std::uint64_t n) {
  std::uint64_t x = (seed ^ 0x6a09e667f3bcc909) * 0xd1342543de82ef95 + (n + 1) * 0x9e3779b97f4a7c15;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

double mean_mass(const std::vector<SeedKind>& kinds, const Inlet& inlet) {
  double mass = 0;
  for (std::size_t k = 0; k < kinds.size(); ++k) mass += inlet.shares[k] * kinds[k].density * kinds[k].mean_volume();
  return mass;
}

double open_time(const Inlet& inlet, double time) {
  return std::max(0.0, std::min(time, inlet.until) - inlet.from);
}

}  // namespace

std::int64_t expected_count(const std::vector<SeedKind>& kinds, const Inlet& inlet, double end) {
  return std::llround(inlet.rate * open_time(inlet, end) / (inlet.basis == Basis::mass ? mean_mass(kinds, inlet) : 1));
}

Insertion::Insertion(const Decomposition& decomposition, const DemSetup& setup, std::vector<SeedKind> kinds,
                     std::vector<Inlet> inlets)
    : decomposition_(decomposition),
      setup_(setup),
      kinds_(std::move(kinds)),
      inlets_(std::move(inlets)),
      states_(inlets_.size()) {}

void Insertion::restore(std::vector<InletState> states) {
  if (states.size() != inlets_.size()) {
    throw Stop(Reason::invalid_case, "the checkpoint is of another scene: " + std::to_string(states.size()) +
                                         " particle_inflows there and " + std::to_string(inlets_.size()) + " in the case");
  }
  states_ = std::move(states);
}

// ---------------------------------------------------------------------------------------------------- what is due

// Particles or kg.
double Insertion::due(const Inlet& inlet, const InletState& state, double time) const {
  return inlet.rate * open_time(inlet, time) - (inlet.basis == Basis::mass ? state.mass : static_cast<double>(state.entered));
}

double Insertion::mass_due(double time) const {
  double mass = 0;
  for (std::size_t i = 0; i < inlets_.size(); ++i)
    mass += (inlets_[i].basis == Basis::mass ? 1 : mean_mass(kinds_, inlets_[i])) * due(inlets_[i], states_[i], time);
  return mass;
}

// Type and size of a particle depend on nothing but its number.
PlacedSphere Insertion::next(const Inlet& inlet, std::int64_t serial) const {
  const double pick = uniform(inlet.seed, 2 * static_cast<std::uint64_t>(serial));
  std::size_t kind = 0;
  for (double below = inlet.shares[0]; pick >= below && kind + 1 < inlet.shares.size();) below += inlet.shares[++kind];
  while (inlet.shares[kind] == 0) --kind;  // round-off in the sum of the shares
  const SizeDistribution& sizes = kinds_[kind].sizes;
  PlacedSphere sphere;
  sphere.velocity = inlet.velocity;
  sphere.kind = static_cast<int>(kind);
  sphere.diameter =
      sizes.constant() ? sizes.largest() : sizes.quantile(uniform(inlet.seed, 2 * static_cast<std::uint64_t>(serial) + 1));
  return sphere;
}

// Those that are due, in their order; no more than could enter side by side.
std::vector<PlacedSphere> Insertion::waiting(const Inlet& inlet, const InletState& state, double time) const {
  double area = densest_layer;
  for (int d = 0; d < 3; ++d)
    if (d != inlet.direction) area *= inlet.high[d] - inlet.low[d];
  std::vector<PlacedSphere> batch;
  for (double left = due(inlet, state, time); area > 0;) {
    const PlacedSphere sphere = next(inlet, state.entered + static_cast<std::int64_t>(batch.size()));
    left -= inlet.basis == Basis::mass ? setup_.types[sphere.kind].mass_of(sphere.diameter / 2) : 1;
    if (left < 0) break;
    area -= std::numbers::pi / 4 * sphere.diameter * sphere.diameter;
    batch.push_back(sphere);
  }
  return batch;
}

// ---------------------------------------------------------------------------------------------------- places

// Touching the face at a moment of the step that is drawn too.
Vec3 Insertion::place(const Inlet& inlet, double radius, double dt, std::uint64_t draw) const {
  Vec3 x;
  for (int d = 0; d < 3; ++d) {
    const double u = uniform(~inlet.seed, 3 * draw + d);
    if (d == inlet.direction) {
      const double depth = radius + u * dt * std::abs(inlet.velocity[d]);
      x[d] = inlet.side == 0 ? depth : decomposition_.size()[d] - depth;
    } else {
      x[d] = inlet.low[d] + radius + u * (inlet.high[d] - inlet.low[d] - 2 * radius);
    }
  }
  return x;
}

bool Insertion::overlap(Vec3 a, Vec3 b, double distance) const {
  Vec3 apart = a - b;
  for (int d = 0; d < 3; ++d)
    if (decomposition_.periodic(d)) apart[d] -= decomposition_.size()[d] * std::round(apart[d] / decomposition_.size()[d]);
  return dot(apart, apart) < distance * distance;
}

// Above 0 for each try that a particle of any rank is in the way of.
std::vector<double> Insertion::blocked(const std::vector<PlacedSphere>& batch, const std::vector<Vec3>& tries,
                                       const ParticleStore& particles) const {
  Vec3 low = tries.front(), high = low;
  double widest = 0;
  for (const Vec3 x : tries)
    for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], x[d]), high[d] = std::max(high[d], x[d]);
  for (const PlacedSphere& sphere : batch) widest = std::max(widest, sphere.diameter / 2);
  const double reach = widest + setup_.largest_radius();
  const auto beside = [&](Vec3 x) {
    for (int d = 0; d < 3; ++d)
      if (!decomposition_.periodic(d) && (x[d] < low[d] - reach || x[d] > high[d] + reach)) return false;
    return true;
  };
  std::vector<double> result(tries.size());
  for (std::size_t i = 0; i < particles.owned; ++i) {
    const Vec3 x = particles.position(i);
    if (!beside(x)) continue;
    const double radius = radius_of(setup_.types, particles, i);
    for (std::size_t t = 0; t < tries.size(); ++t)
      if (overlap(x, tries[t], radius + batch[t / tries_a_step].diameter / 2)) result[t] = 1;
  }
  decomposition_.comm().sum(result);
  return result;
}

// ---------------------------------------------------------------------------------------------------- a step

std::vector<Newcomer> Insertion::enter(double time, double dt, const ParticleStore& particles, std::int64_t& next_id) {
  std::vector<Newcomer> entered;
  for (std::size_t inlet = 0; inlet < inlets_.size(); ++inlet) enter_through(inlet, time, dt, particles, next_id, entered);
  return entered;
}

void Insertion::enter_through(std::size_t index, double time, double dt, const ParticleStore& particles, std::int64_t& next_id,
                              std::vector<Newcomer>& entered) {
  const Inlet& inlet = inlets_[index];
  InletState& state = states_[index];
  const std::vector<PlacedSphere> batch = waiting(inlet, state, time);
  if (batch.empty()) return;
  std::vector<Vec3> tries;
  for (const PlacedSphere& sphere : batch)
    for (std::size_t t = 0; t < tries_a_step; ++t)
      tries.push_back(place(inlet, sphere.diameter / 2, dt, static_cast<std::uint64_t>(state.draws++)));
  const std::vector<double> in_the_way = blocked(batch, tries, particles);
  for (std::size_t n = 0; n < batch.size(); ++n) {
    const PlacedSphere& sphere = batch[n];
    const auto is_free = [&](std::size_t t) {
      return in_the_way[t] == 0 && std::ranges::none_of(entered, [&](const Newcomer& other) {
               return overlap(tries[t], other.position, sphere.diameter / 2 + other.radius);
             });
    };
    std::size_t t = n * tries_a_step;
    while (t < (n + 1) * tries_a_step && !is_free(t)) ++t;
    if (t == (n + 1) * tries_a_step) {
      ++state.blocked;
      return;
    }
    state.mass += setup_.types[sphere.kind].mass_of(sphere.diameter / 2);
    ++state.entered;
    entered.push_back({next_id++, tries[t], sphere.velocity, sphere.kind, sphere.diameter / 2});
  }
}

}  // namespace bedflow
