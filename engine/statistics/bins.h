// Time averages over non-overlapping bins.
//
// Bin i covers T0 + i Tb < t ≤ T0 + (i+1) Tb, i = 0 … N−1, and takes the steps that end in it, each weighted with the whole of
// its length: a step that straddles a bin's edge counts to the bin that holds its end. Round-off in the time does not
// matter: a step that ends within a thousandth of its length of an edge ends on it.
//
// Mean and variance by West's weighted update (CACM 22, 1979), which does not cancel:
//   W += dt,   δ = v − mean,   mean += δ dt/W,   S += dt δ (v − mean),   deviation = √(S/W)
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace bedflow {

// Called for each bin that is complete: its number, time mean and standard deviation in time, each one a place; NaN at a place
// that had no value in the whole bin.
using BinClosed = std::function<void(int bin, std::span<const double> mean, std::span<const double> deviation)>;

class Bins {
 public:
  Bins(double start, double length, int count, std::size_t places);  // T0, Tb in s; Tb = 0: no averaging

  // Whether the step that ends at `time` after dt (s) counts to a bin.
  bool wants(double time, double dt) const;

  // Takes the values of that step and closes the bins that it completes. A place whose value is NaN is left out for this
  // step (Link's rule for instants with an empty bin). values may be empty when wants() is false. Call for every step.
  void take(double time, double dt, std::span<const double> values, const BinClosed& closed);

  // What restore() needs to go on with the same bits; always state_size() numbers.
  std::size_t state_size() const { return 1 + 3 * sums_.size(); }
  void save(std::vector<double>& state) const;
  void restore(std::span<const double> state);

 private:
  struct Sums {
    double weight = 0, mean = 0, spread = 0;  // W, mean, S
  };
  std::int64_t bin_of(double time, double dt) const;
  void close(const BinClosed& closed);

  double start_, length_;
  std::int64_t count_;
  std::int64_t open_ = 0;  // the bin that is gathered, or waited for
  std::vector<Sums> sums_;
};

}  // namespace bedflow
