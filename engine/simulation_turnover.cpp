// Particles that enter and leave in the course of a simulation, and the account of them.
#include <array>
#include <sstream>
#include <string>

#include "simulation.h"

namespace bedflow {

// Sums over all ranks, in one reduction: what there is, what has left since the last call.
void Simulation::turn_over_particles(double dt) {
  if (dem_->stopped()) return;
  if (insertion_) {
    const std::vector<Newcomer> newcomers = insertion_->enter(time_, dt, dem_->particles(), next_id_);
    for (const Newcomer& n : newcomers) turnover_.entered.add(dem_->setup().types[n.type].mass_of(n.radius));
    dem_->enter(newcomers);
  }
  const Departed gone = dem_->take_departed();
  const Amount here = amount_here();
  std::array<double, 10> sums{static_cast<double>(here.count),
                              here.mass,
                              static_cast<double>(gone.amount.count),
                              gone.amount.mass,
                              gone.momentum.x,
                              gone.momentum.y,
                              gone.momentum.z,
                              gone.debt.x,
                              gone.debt.y,
                              gone.debt.z};
  decomposition_.comm().sum(sums);
  const Amount there{static_cast<std::int64_t>(sums[0]), sums[1]};
  turnover_.left.count += static_cast<std::int64_t>(sums[2]);
  turnover_.left.mass += sums[3];
  turnover_.momentum_left += {sums[4], sums[5], sums[6]};
  turnover_.debt_left += {sums[7], sums[8], sums[9]};
  particle_count_ = there.count;
  if (turnover_.balances(there)) return;
  std::ostringstream text;
  text.precision(17);
  const auto amount = [&](const char* name, const Amount& of) { text << of.count << " (" << of.mass << " kg) " << name; };
  text << "in step " << steps_ + 1 << " the particles do not balance: ";
  amount("at time 0, ", turnover_.initial);
  amount("entered, ", turnover_.entered);
  amount("left, ", turnover_.left);
  amount("are there", there);
  throw Stop(Reason::internal, text.str());
}

// Of this rank.
Amount Simulation::amount_here() const {
  const ParticleStore& store = dem_->particles();
  Amount here;
  for (std::size_t p = 0; p < store.owned; ++p) here.add(mass_of(dem_->setup().types, store, p));
  return here;
}

// Of all ranks.
Amount Simulation::present() const {
  const Amount here = amount_here();
  return {decomposition_.comm().sum(here.count), decomposition_.comm().sum(here.mass)};
}

std::vector<SizeMoments> Simulation::size_moments() const {
  if (!dem_) return {};
  const DemSetup& setup = dem_->setup();
  std::vector<SizeSums> sums;
  for (const ParticleType& type : setup.types) sums.emplace_back(2 * type.radius);
  const ParticleStore& store = dem_->particles();
  for (std::size_t p = 0; p < store.owned; ++p)
    sums[store.type.empty() ? 0 : store.type[p]].add(2 * radius_of(setup.types, store, p), mass_of(setup.types, store, p));
  std::vector<SizeMoments> moments;
  moments.reserve(sums.size());
  for (const SizeSums& of_type : sums) moments.push_back(of_type.over_all(decomposition_.comm()));
  return moments;
}

// ---------------------------------------------------------------------------------------------------- checkpoint

void Simulation::put_turnover(CheckpointContent& content) const {
  const auto put = [&](const std::string& name, const Amount& amount) {
    content.numbers["turnover/" + name + "_count"] = static_cast<double>(amount.count);
    content.numbers["turnover/" + name + "_mass"] = amount.mass;
  };
  put("initial", turnover_.initial);
  put("entered", turnover_.entered);
  put("left", turnover_.left);
  for (int d = 0; d < 3; ++d) {
    content.numbers[std::string("turnover/momentum_left_") + "xyz"[d]] = turnover_.momentum_left[d];
    content.numbers[std::string("turnover/debt_left_") + "xyz"[d]] = turnover_.debt_left[d];
  }
  content.numbers["turnover/next_id"] = static_cast<double>(next_id_);
  const std::vector<InletState> states = insertion_ ? insertion_->states() : std::vector<InletState>();
  content.numbers["inlets/count"] = static_cast<double>(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::string inlet = "inlets/" + std::to_string(i);
    content.numbers[inlet + "_entered"] = static_cast<double>(states[i].entered);
    content.numbers[inlet + "_mass"] = states[i].mass;
    content.numbers[inlet + "_draws"] = static_cast<double>(states[i].draws);
    content.numbers[inlet + "_blocked"] = static_cast<double>(states[i].blocked);
  }
}

void Simulation::restore_turnover(const CheckpointSource& from) {
  const auto count = [&](const std::string& name) { return static_cast<std::int64_t>(from.number(name)); };
  const auto take = [&](const std::string& name) {
    return Amount{count("turnover/" + name + "_count"), from.number("turnover/" + name + "_mass")};
  };
  turnover_ = {take("initial"), take("entered"), take("left"), {}, {}};
  for (int d = 0; d < 3; ++d) {
    turnover_.momentum_left[d] = from.number(std::string("turnover/momentum_left_") + "xyz"[d]);
    turnover_.debt_left[d] = from.number(std::string("turnover/debt_left_") + "xyz"[d]);
  }
  next_id_ = count("turnover/next_id");
  if (!insertion_) return;
  std::vector<InletState> states(static_cast<std::size_t>(count("inlets/count")));
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::string inlet = "inlets/" + std::to_string(i);
    states[i] = {count(inlet + "_entered"), from.number(inlet + "_mass"), count(inlet + "_draws"), count(inlet + "_blocked")};
  }
  insertion_->restore(std::move(states));
}

}  // namespace bedflow
