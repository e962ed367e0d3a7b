// What enters and leaves a scene: the account of its particles since time 0.
#pragma once

#include <cstdint>
#include <limits>

#include "base/vec3.h"

namespace bedflow {

struct Newcomer {
  std::int64_t id = 0;
  Vec3 position, velocity;  // m, m/s
  int type = 0;
  double radius = 0;  // m
};

struct Amount {
  std::int64_t count = 0;
  double mass = 0;  // kg

  void add(double one) {
    ++count;
    mass += one;
  }
};

// Particles that have left.
struct Departed {
  Amount amount;
  Vec3 momentum;  // m V, kg·m/s
  Vec3 debt;      // what they had received from the gas beyond what it lost for them, N·s: nobody pays it any more
};

struct Turnover {
  Amount initial, entered, left;
  Vec3 momentum_left{}, debt_left{};  // of those, as above

  // Whether what is present is what should be: the count exactly, the mass to the round-off of sums of so many terms.
  bool balances(const Amount& present) const {
    const auto all = static_cast<double>(initial.count + entered.count);
    const double round_off = 4 * all * std::numeric_limits<double>::epsilon() * (initial.mass + entered.mass);
    const double missing = initial.mass + entered.mass - left.mass - present.mass;
    return initial.count + entered.count - left.count == present.count && missing <= round_off && -missing <= round_off;
  }
};

}  // namespace bedflow
