#include "statistics/bins.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bedflow {

namespace {
constexpr double edge_tolerance = 1e-3;  // of a step: far above the round-off of a million summed steps, far below a step
}

Bins::Bins(double start, double length, int count, std::size_t places)
    : start_(start), length_(length), count_(length > 0 ? count : 0), sums_(places) {}

// The bin that holds the end of a step; below 0 before the first.
std::int64_t Bins::bin_of(double time, double dt) const {
  return static_cast<std::int64_t>(std::ceil((time - edge_tolerance * dt - start_) / length_)) - 1;
}

bool Bins::wants(double time, double dt) const {
  if (open_ >= count_ || !(dt > 0)) return false;
  const std::int64_t bin = bin_of(time, dt);
  return bin >= 0 && bin < count_;
}

void Bins::take(double time, double dt, std::span<const double> values, const BinClosed& closed) {
  if (open_ >= count_ || !(dt > 0)) return;
  const std::int64_t bin = bin_of(time, dt);
  while (open_ < std::min(bin, count_)) close(closed);  // the step straddled their upper edges
  if (bin < 0 || bin >= count_) return;
  for (std::size_t place = 0; place < sums_.size(); ++place) {
    const double value = values[place];
    if (std::isnan(value)) continue;
    Sums& s = sums_[place];
    s.weight += dt;
    const double difference = value - s.mean;
    s.mean += difference * (dt / s.weight);
    s.spread += dt * difference * (value - s.mean);
  }
  const double edge = start_ + static_cast<double>(open_ + 1) * length_;
  if (time >= edge - edge_tolerance * dt) close(closed);
}

void Bins::close(const BinClosed& closed) {
  constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> mean, deviation;
  for (Sums& s : sums_) {
    mean.push_back(s.weight > 0 ? s.mean : nothing);
    deviation.push_back(s.weight > 0 ? std::sqrt(std::max(0.0, s.spread) / s.weight) : nothing);
    s = {};
  }
  if (closed) closed(static_cast<int>(open_), mean, deviation);
  ++open_;
}

void Bins::save(std::vector<double>& state) const {
  state.push_back(static_cast<double>(open_));
  for (const Sums& s : sums_) state.insert(state.end(), {s.weight, s.mean, s.spread});
}

void Bins::restore(std::span<const double> state) {
  open_ = static_cast<std::int64_t>(state[0]);
  for (std::size_t place = 0; place < sums_.size(); ++place) {
    sums_[place] = {state[1 + 3 * place], state[2 + 3 * place], state[3 + 3 * place]};
  }
}

}  // namespace bedflow
