#include "statistics/monitors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/stop.h"

namespace bedflow {

namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

template <class Law>
void sum_over_particles(const Law& law, const StatisticScene& scene, const Observation& now, std::span<double> sums) {
  const ParticleStore& particles = *now.particles;
  for (std::size_t i = 0; i < particles.owned; ++i) {
    const int type = particles.type.empty() ? 0 : particles.type[i];
    const double radius = radius_of(*now.types, particles, i), mass = (*now.types)[type].mass_of(radius);
    law.add(scene, {particles.position(i), particles.velocity(i), particles.spin(i), radius, mass, type}, sums);
  }
}

// Only the rows of cells that bear on the value are read. fall: of the quantity per length upward, beside that of the field.
template <class Law>
void sum_over_cells(const Law& law, const StatisticScene& scene, const Grid& grid, const Field& field, double fall,
                    std::span<double> sums) {
  for (int j = 0; j < grid.cells[1]; ++j) {
    const double weight = law.weight(scene, grid.first[1] + j);
    if (weight == 0) continue;
    const double beside = -fall * (grid.first[1] + j + 0.5) * grid.spacing.y;
    for (int k = 0; k < grid.cells[2]; ++k) {
      for (int i = 0; i < grid.cells[0]; ++i) sums[law.slot(grid.first[0] + i)] += weight * (field(i, j, k) + beside);
    }
  }
}

// What the statistic looks at; null where the scene does not have it.
const Field* field_of(Subject subject, const Observation& now) {
  return subject == Subject::pressure ? now.pressure : now.fraction;
}
bool present(Subject subject, const Observation& now) {
  if (subject == Subject::particles) return now.particles != nullptr;
  if (subject == Subject::walls) return !now.wall_loads.empty();
  return subject == Subject::step || (now.grid != nullptr && field_of(subject, now) != nullptr);
}

bool peaks(const Statistic& statistic) {
  return std::visit([]<class Law>(const Law&) { return keeps_peak<Law>; }, statistic);
}

}  // namespace

Monitors::Monitors(const StatisticScene& scene, std::vector<MonitorSetup> setups, StatisticsSink sink)
    : scene_(scene), sink_(std::move(sink)) {
  for (MonitorSetup& setup : setups) {
    const std::size_t places = std::visit(
        [&]<class Law>(const Law& law) { return has_places<Law> ? places_of(law, scene_).size() : 1; }, setup.statistic);
    const Bins bins(setup.averaging_start, setup.averaging_bin, setup.averaging_bins, places);
    monitors_.push_back({.setup = std::move(setup), .bins = bins, .values = std::vector<double>(places)});
  }
}

std::string Monitors::unit(std::size_t monitor) const {
  return std::visit([](const auto& law) { return law.unit; }, setup(monitor).statistic);
}
std::string Monitors::meaning(std::size_t monitor) const {
  return std::visit([](const auto& law) { return law.meaning; }, setup(monitor).statistic);
}
bool Monitors::is_profile(std::size_t monitor) const {
  return std::visit([]<class Law>(const Law&) { return has_places<Law>; }, setup(monitor).statistic);
}
std::vector<double> Monitors::places(std::size_t monitor) const {
  return std::visit([&](const auto& law) { return places_of(law, scene_); }, setup(monitor).statistic);
}

// Marks what this step is to evaluate; returns how many sums that takes.
std::size_t Monitors::find_due(double time, double dt, bool last) {
  std::size_t count = 0;
  for (Monitor& m : monitors_) {
    const double reached = time + 1e-3 * dt;  // round-off in the time does not move a sample to the next step
    m.averaged = m.bins.wants(time, dt);
    std::visit(
        [&]<class Law>(const Law& law) {
          const double interval = m.setup.interval;
          m.sampled =
              !has_places<Law> && (!begun_ || last || interval <= 0 || reached >= static_cast<double>(m.next_sample) * interval);
          if (m.sampled && interval > 0) m.next_sample = static_cast<std::int64_t>(std::floor(reached / interval)) + 1;
          m.first_sum = count;
          if (m.sampled || m.averaged) count += sums_of(law, scene_);
        },
        m.setup.statistic);
  }
  begun_ = true;
  return count;
}

// This rank's contributions to the sums of all that is due.
void Monitors::gather(const Observation& now) {
  for (const Monitor& m : monitors_) {
    if (!m.sampled && !m.averaged) continue;
    std::visit(
        [&]<class Law>(const Law& law) {
          if (!present(Law::subject, now)) return;
          const std::span<double> sums = std::span(sums_).subspan(m.first_sum, sums_of(law, scene_));
          if constexpr (Law::subject == Subject::particles) {
            sum_over_particles(law, scene_, now, sums);
          } else if constexpr (Law::subject == Subject::walls) {
            const WallLoad& load = now.wall_loads[law.wall];
            law.add(load.force, load.torque, sums);
          } else if constexpr (Law::subject != Subject::step) {
            const double fall = Law::subject == Subject::pressure ? now.pressure_fall : 0;
            sum_over_cells(law, scene_, *now.grid, *field_of(Law::subject, now), fall, sums);
          }
        },
        m.setup.statistic);
  }
}

// The monitor's value or values from the sums of all ranks.
void Monitors::evaluate(const Observation& now, double max_overlap, Monitor& m) const {
  std::visit(
      [&]<class Law>(const Law& law) {
        if constexpr (Law::subject == Subject::step) {
          m.values[0] = law.value({max_overlap, now.mass_residual, now.momentum_residual, now.mass_entered, now.mass_left});
        } else if (present(Law::subject, now)) {
          values_from(law, scene_, std::span(sums_).subspan(m.first_sum, sums_of(law, scene_)), m.values);
        } else {
          std::fill(m.values.begin(), m.values.end(), nothing);
        }
        if constexpr (keeps_peak<Law>) m.peak = std::max(m.peak, m.values[0]);
      },
      m.setup.statistic);
}

void Monitors::report(std::size_t monitor, std::uint64_t step, double time, double dt) {
  Monitor& m = monitors_[monitor];
  if (m.sampled) {
    const double value = peaks(m.setup.statistic) ? m.peak : m.values[0];
    if (sink_.sample && !std::isnan(value)) sink_.sample({monitor, step, time, value});
    m.peak = 0;
  }
  m.bins.take(time, dt, m.values, [&](int bin, std::span<const double> mean, std::span<const double> deviation) {
    if (sink_.bin) sink_.bin({monitor, bin, step, mean, deviation});
  });
}

void Monitors::observe(const Observation& now, std::uint64_t step, double time, double dt, bool last) {
  sums_.assign(find_due(time, dt, last), 0);
  gather(now);
  const Comm& comm = now.decomposition.comm();
  if (!sums_.empty()) comm.sum(sums_);
  const bool overlap = std::ranges::any_of(monitors_, [](const Monitor& m) { return peaks(m.setup.statistic); });
  const double max_overlap = overlap ? comm.max(now.max_overlap) : 0;
  for (std::size_t i = 0; i < monitors_.size(); ++i) {
    Monitor& m = monitors_[i];
    if (m.sampled || m.averaged || peaks(m.setup.statistic)) evaluate(now, max_overlap, m);
    report(i, step, time, dt);
  }
}

std::vector<double> Monitors::state() const {
  std::vector<double> state{begun_ ? 1.0 : 0.0};
  for (const Monitor& m : monitors_) {
    state.push_back(static_cast<double>(m.next_sample));
    state.push_back(m.peak);
    m.bins.save(state);
  }
  return state;
}

void Monitors::restore(std::span<const double> state) {
  std::size_t wanted = 1;
  for (const Monitor& m : monitors_) wanted += 2 + m.bins.state_size();
  if (state.size() != wanted) {
    throw Stop(Reason::checkpoint_corrupt, "the checkpoint's statistics hold " + std::to_string(state.size()) +
                                               " numbers; the monitors of the case need " + std::to_string(wanted));
  }
  begun_ = state[0] != 0;
  state = state.subspan(1);
  for (Monitor& m : monitors_) {
    m.next_sample = static_cast<std::int64_t>(state[0]);
    m.peak = state[1];
    m.bins.restore(state.subspan(2, m.bins.state_size()));
    state = state.subspan(2 + m.bins.state_size());
  }
}

}  // namespace bedflow
