// The monitors of a case: samples of each statistic and its averages over bins of time.
//
// A sample is taken at the first observation, at each multiple of the monitor's interval (at the first step that ends there or
// later, to a thousandth of a step), at every step if the interval is 0, and at the last step. Profiles keep no samples, only
// bins. Only what is due is evaluated, all ranks' sums in one reduction a step; every rank holds the same sums and averages.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grid/grid.h"
#include "models/statistic.h"
#include "particles/dem.h"
#include "statistics/bins.h"

namespace bedflow {

struct MonitorSetup {
  std::string name;
  Statistic statistic;
  double interval = 0.001;     // s; 0: every step
  double averaging_start = 0;  // T0, s
  double averaging_bin = 0;    // Tb, s; 0: no averages
  int averaging_bins = 0;      // N
};

// The scene at the end of a step. A part that is absent is null; a statistic of it has no values.
struct Observation {
  const Decomposition& decomposition;
  const Grid* grid = nullptr;
  const Field* pressure = nullptr;           // Pa
  double pressure_fall = 0;                  // upward, beside that of `pressure` (a driven periodic flow's), Pa/m
  const Field* fraction = nullptr;           // ε
  const ParticleStore* particles = nullptr;  // of this rank
  std::vector<WallLoad> wall_loads{};        // in the step, the mean, this rank; of the faces of the box, then of the walls
  const std::vector<ParticleType>* types = nullptr;  // of the particles
  double max_overlap = 0;                            // in the step, over the diameter, this rank
  double mass_residual = 0;                          // in the step, the same on every rank
  double momentum_residual = 0;                      // in the step, the same on every rank
  double mass_entered = 0, mass_left = 0;            // particles since time 0, kg, the same on every rank
};

struct SampleOut {
  std::size_t monitor = 0;
  std::uint64_t step = 0;
  double time = 0, value = 0;  // s; never NaN
};
struct BinOut {
  std::size_t monitor = 0;
  int bin = 0;                              // 0-based
  std::uint64_t step = 0;                   // the step that closed it
  std::span<const double> mean, deviation;  // one a place; NaN where nothing was seen
};
// Where the results go; a rank that reports nothing leaves the functions empty.
struct StatisticsSink {
  std::function<void(const SampleOut&)> sample;
  std::function<void(const BinOut&)> bin;
};

class Monitors {
 public:
  Monitors(const StatisticScene& scene, std::vector<MonitorSetup> setups, StatisticsSink sink);

  std::size_t size() const { return monitors_.size(); }
  const MonitorSetup& setup(std::size_t monitor) const { return monitors_[monitor].setup; }
  std::string unit(std::size_t monitor) const;
  std::string meaning(std::size_t monitor) const;
  bool is_profile(std::size_t monitor) const;
  std::vector<double> places(std::size_t monitor) const;  // the profile's bin centres, m; empty for a series

  // Collective. The step that ends at `time` after dt (s); dt = 0: the state at the start, which no bin takes. `last`: the case
  // ends here (not merely this attempt), so each series gets a sample.
  void observe(const Observation& now, std::uint64_t step, double time, double dt, bool last = false);

  // All that must survive a checkpoint, the same on every rank; restored, the run goes on with the same bits.
  std::vector<double> state() const;
  // For the same setups. Throws Stop(checkpoint_corrupt) where the length does not fit them.
  void restore(std::span<const double> state);

 private:
  struct Monitor {
    MonitorSetup setup;
    Bins bins;
    std::int64_t next_sample = 0;  // multiple of the interval
    double peak = 0;               // since the last sample, of a statistic of peaks
    bool sampled = false, averaged = false;
    std::size_t first_sum = 0;
    std::vector<double> values;
  };
  std::size_t find_due(double time, double dt, bool last);
  void gather(const Observation& now);
  void evaluate(const Observation& now, double max_overlap, Monitor& monitor) const;
  void report(std::size_t monitor, std::uint64_t step, double time, double dt);

  StatisticScene scene_;
  std::vector<Monitor> monitors_;
  StatisticsSink sink_;
  bool begun_ = false;
  std::vector<double> sums_;  // of all due monitors, one after another
};

}  // namespace bedflow
