#include "study_results.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace bedflow::server {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

void add(Measured& quantity, const v1::Estimate& estimate) {
  const bool seen = estimate.bins() > 0;
  quantity.mean.push_back(seen ? estimate.mean() : nan);
  quantity.half_width.push_back(seen && estimate.has_half_width() ? estimate.half_width() : nan);
  quantity.bins = std::max(quantity.bins, estimate.bins());
}

// Over the values that are there; NaN if none is.
double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  int count = 0;
  for (const double value : values) {
    if (std::isnan(value)) continue;
    sum += value * value;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : nan;
}

// A single value keeps its sign.
double overall(const std::vector<double>& values) {
  return values.size() == 1 ? values.front() : root_mean_square(values);
}

// Of the runs that have been measured.
struct Worth {
  double cost, error;
};
std::optional<Worth> worth_of(const v1::StudyRun& run, int quantity) {
  if (!run.has_cost() || quantity >= run.errors_size() || !run.errors(quantity).has_value()) return std::nullopt;
  const v1::StudyError& error = run.errors(quantity);
  return Worth{run.cost().cpu_seconds(), error.equal() ? 0 : std::abs(error.value())};
}

}  // namespace

Measured measured(const v1::Statistics& statistics, const v1::StudyQuantity& quantity) {
  Measured found;
  for (const auto& series : statistics.series()) {
    if (series.name() == quantity.monitor()) add(found, quantity.fluctuation() ? series.deviation() : series.average());
  }
  for (const auto& profile : statistics.profiles()) {
    if (profile.name() != quantity.monitor()) continue;
    for (const auto& estimate : quantity.fluctuation() ? profile.deviation() : profile.average()) add(found, estimate);
  }
  return found.bins > 0 ? found : Measured{};
}

v1::Estimate overall(const Measured& quantity) {
  v1::Estimate estimate;
  estimate.set_bins(quantity.bins);
  if (quantity.bins == 0) return estimate;
  estimate.set_mean(overall(quantity.mean));
  if (const double half = root_mean_square(quantity.half_width); !std::isnan(half)) estimate.set_half_width(half);
  return estimate;
}

v1::StudyError difference(const Measured& run, const Measured& reference) {
  v1::StudyError error;
  if (run.mean.size() != reference.mean.size() || run.mean.empty()) return error;
  std::vector<double> differences, half_widths;
  for (std::size_t i = 0; i < run.mean.size(); ++i) {
    differences.push_back(run.mean[i] - reference.mean[i]);
    half_widths.push_back(std::hypot(run.half_width[i], reference.half_width[i]));
  }
  const double value = overall(differences), half_width = root_mean_square(half_widths);
  if (std::isnan(value)) return error;
  error.set_value(value);
  if (std::isnan(half_width)) return error;
  error.set_half_width(half_width);
  error.set_equal(std::abs(value) <= half_width);
  return error;
}

bool is_narrow_enough(const Measured& quantity, const v1::StudyStop& stop) {
  if (quantity.bins < std::max(2U, stop.bins())) return false;
  const double half = root_mean_square(quantity.half_width), mean = root_mean_square(quantity.mean);
  return half <= stop.relative() * mean;
}

void mark_front(v1::Study& study) {
  for (auto& run : *study.mutable_runs()) run.clear_on_front();
  for (int quantity = 0; quantity < study.spec().quantities_size(); ++quantity) {
    for (auto& run : *study.mutable_runs()) {
      const auto mine = worth_of(run, quantity);
      const bool beaten = mine && std::ranges::any_of(study.runs(), [&](const v1::StudyRun& other) {
                            const auto theirs = worth_of(other, quantity);
                            return theirs && theirs->cost <= mine->cost && theirs->error <= mine->error &&
                                   (theirs->cost < mine->cost || theirs->error < mine->error);
                          });
      run.add_on_front(mine && !beaten);
    }
  }
}

}  // namespace bedflow::server
