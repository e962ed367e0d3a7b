// How far beyond contact the pair list should reach. A wider skin lists more pairs, which every sub-step must look at; a thinner
// one is outlived sooner, and the list built anew. With x = skin over diameter, from what was counted at the present x0:
//   pairs(x) = pairs(x0) ((1 + x)/(1 + x0))³,   sub-steps between rebuilds  n(x) = n(x0) x/x0   (particles fly straight)
//   cost(x) = look pairs(x) + (sort + list pairs(x))/n(x)
// Only counts enter, no clock: the same run chooses the same skins.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace bedflow {

class SkinTuner {
 public:
  // Costs a particle or pair, ns: measured by bench_dem on one core; only their ratios count.
  static constexpr double look = 1.3, sort = 100, list = 25;
  static constexpr std::int64_t rebuilds_a_turn = 8, longest_turn = 4000;  // sub-steps, for beds at rest

  // diameter: of the largest particles, m; widest: skin that blocks and grid allow, m, 0 to keep the skin as it is.
  SkinTuner(double diameter, double widest) : diameter_(diameter), widest_(widest) {}

  struct Counts {
    std::int64_t substeps = 0, rebuilds = 0;  // since the last choice
  };
  Counts counts;

  bool tunes() const { return widest_ > 0; }
  bool due() const { return tunes() && (counts.rebuilds >= rebuilds_a_turn || counts.substeps >= longest_turn); }

  // The cheapest skin, at most twice or half the present one. pairs: of the list with that, a particle.
  double choose(double skin, double pairs) {
    const double substeps =
        static_cast<double>(counts.substeps) / static_cast<double>(std::max<std::int64_t>(counts.rebuilds, 1));
    double best = skin, least = cost(skin, skin, pairs, substeps);
    for (int i = -8; i <= 8; ++i) {
      const double candidate = std::clamp(skin * std::exp2(i / 8.0), std::min(0.02 * diameter_, widest_), widest_);
      const double now = cost(candidate, skin, pairs, substeps);
      if (now < 0.99 * least) best = candidate, least = now;
    }
    counts = {};
    return best;
  }

 private:
  double cost(double skin, double present, double pairs, double substeps) const {
    const double listed = pairs * std::pow((diameter_ + skin) / (diameter_ + present), 3);
    return look * listed + (sort + list * listed) / (substeps * skin / present);
  }

  double diameter_, widest_;
};

}  // namespace bedflow
