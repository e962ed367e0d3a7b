#include "hardware.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <vector>

namespace bedflow {

namespace {

// Units of work per CPU second; the best of several passes.
template <class Work>
double best_rate(double units, Work work) {
  double best = 0;
  for (int pass = 0; pass < 20; ++pass) {
    const std::clock_t start = std::clock();
    work();
    best = std::max(best, units * CLOCKS_PER_SEC / static_cast<double>(std::clock() - start));
  }
  return best;
}

constexpr std::size_t lanes = 8;
typedef double Lanes __attribute__((vector_size(lanes * sizeof(double))));

}  // namespace

double triad_bandwidth(std::size_t bytes) {
  const std::size_t n = bytes / 24;
  std::vector<double> a(n, 1), b(n, 2), c(n, 3);
  const int repeats = static_cast<int>(2e8 / static_cast<double>(bytes)) + 1;
  return best_rate(repeats * 24.0 * static_cast<double>(n), [&] {
    for (int repeat = 0; repeat < repeats; ++repeat) {
      for (std::size_t i = 0; i < n; ++i) a[i] = b[i] + 0.5 * c[i];
      benchmark::DoNotOptimize(a.data());
      benchmark::ClobberMemory();
    }
  });
}

double peak_flops() {
  constexpr int repeats = 1000000;
  std::array<Lanes, 10> sums{};  // as many as hide the latency of one behind the others
  return best_rate(2.0 * lanes * sums.size() * repeats, [&] {
    for (int repeat = 0; repeat < repeats; ++repeat)
      for (Lanes& sum : sums) sum = sum * 0.999 + 1.0;
    benchmark::DoNotOptimize(sums);
  });
}

double peak_roots() {
  constexpr int repeats = 100000;
  std::array<double, 8 * lanes> values;
  values.fill(2);
  return best_rate(2.0 * values.size() * repeats, [&] {
    for (int repeat = 0; repeat < repeats; ++repeat) {
      for (double& value : values) value = 3 / std::sqrt(value);
      benchmark::DoNotOptimize(values);
    }
  });
}

}  // namespace bedflow
