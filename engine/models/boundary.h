// Conditions of the gas on the faces of the box. A face between blocks, or a periodic one, has none.
#pragma once

#include <variant>
#include <vector>

#include "base/vec3.h"

namespace bedflow {

// u = velocity of the wall (its normal part is 0); ∂p/∂n follows from the momentum balance.
struct NoSlip {
  static constexpr const char* name = "no_slip_wall";
  Vec3 velocity;  // m/s
};
// u·n = 0, no shear.
struct FreeSlip {
  static constexpr const char* name = "free_slip_wall";
};
// Superficial velocity ε u·n into the box, the same over the face but for rectangles with their own; tangential velocity 0.
// Linear in time from `from` to `velocity` over `ramp` seconds.
struct Inflow {
  static constexpr const char* name = "inflow";
  struct Jet {
    double velocity = 0, from = 0, ramp = 0;  // m/s, m/s, s
    double at(double time) const { return time < ramp ? from + (velocity - from) * time / ramp : velocity; }
  };
  struct Patch {
    Vec3 low, high;  // m; the coordinate normal to the face is ignored
    Jet jet;
  };
  Jet jet;
  std::vector<Patch> patches;
};
// p = pressure on the face; gas leaves freely, and what comes back brings no tangential velocity.
struct Outflow {
  static constexpr const char* name = "outflow";
  double pressure = 0;  // Pa
};

using Boundary = std::variant<NoSlip, FreeSlip, Inflow, Outflow>;

}  // namespace bedflow
