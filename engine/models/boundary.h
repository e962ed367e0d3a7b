// Conditions of the gas on the faces of the box. A face between blocks, or a periodic one, has none.
#pragma once

#include <cmath>
#include <optional>
#include <variant>
#include <vector>

#include "base/vec3.h"

namespace bedflow {

// How a quantity runs in time, as a share of its full value: linear between instants, as the first before and as the last after
// them; without instants the full value always.
struct Schedule {
  struct Instant {
    double time = 0, share = 0;  // s, 1
  };
  std::vector<Instant> instants;  // in order of time

  double at(double time) const {
    if (instants.empty()) return 1;
    if (time <= instants.front().time) return instants.front().share;
    for (std::size_t i = 1; i < instants.size(); ++i) {
      const Instant &a = instants[i - 1], &b = instants[i];
      if (time < b.time) return a.share + (b.share - a.share) * (time - a.time) / (b.time - a.time);
    }
    return instants.back().share;
  }
};

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
// Linear in time from `from` to `velocity` over `ramp` seconds, or as the schedule says.
struct Inflow {
  static constexpr const char* name = "inflow";
  struct Jet {
    double velocity = 0, from = 0, ramp = 0;  // m/s, m/s, s
    Schedule schedule{};
    double at(double time) const { return time < ramp ? from + (velocity - from) * time / ramp : velocity * schedule.at(time); }
  };
  struct Patch {
    Vec3 low, high;  // m; the coordinate normal to the face is ignored
    Jet jet;
  };
  Jet jet;
  std::vector<Patch> patches;
};
// ρg ε u·n A = mass flow: an inflow of the velocity that brings it, over the face (area, m²) or a rectangle of it, whose
// remainder is a no-slip wall.
struct MassInflow : Inflow {
  static constexpr const char* name = "mass_inflow";
  MassInflow(double mass_flow, double density, double area, const Schedule& schedule) {
    jet.velocity = jet.from = mass_flow / (density * area);
    jet.schedule = schedule;
  }
  MassInflow(double mass_flow, double density, double area, const Schedule& schedule, Vec3 low, Vec3 high)
      : MassInflow(mass_flow, density, area, schedule) {
    patches = {{low, high, jet}};
    jet = {};
  }
};
// p = pressure on the face; gas leaves freely. What comes back starts from rest: it brings neither tangential nor normal
// momentum, and so no energy.
struct Outflow {
  static constexpr const char* name = "outflow";
  double pressure = 0;  // Pa
};

using Boundary = std::variant<NoSlip, FreeSlip, Inflow, Outflow, MassInflow>;

// Of a boundary through which gas enters as given; null: another.
inline const Inflow* inflow_of(const Boundary& boundary) {
  if (const MassInflow* mass = std::get_if<MassInflow>(&boundary)) return mass;
  return std::get_if<Inflow>(&boundary);
}

// What drives gas along a periodic direction: a pressure that falls by so much over the box, or whatever fall gives the wanted
// mass flux, the mean of ρg ε u over the box.
struct Drive {
  std::optional<double> pressure_drop;  // Pa
  std::optional<double> mass_flux;      // kg/m²s
  Schedule schedule{};
};

// Rectangles inside the box, in a plane of faces of the grid, with edges on its lines.
//
// No gas through, and none along it: u = 0 on both sides.
struct Baffle {
  static constexpr const char* name = "baffle";
};
// Gas passes against  Δp = R₁ u + R₂ ρg u |u|,  u = superficial velocity through the plate (Darcy and Forchheimer in a layer too
// thin to resolve: R₁ = μ L/K, R₂ = ½ ζ with ζ the loss coefficient).
struct Plate {
  static constexpr const char* name = "plate";
  double linear = 0;                                             // R₁, Pa·s/m
  double quadratic = 0;                                          // R₂, 1
  double resistance(double superficial, double density) const {  // Δp/u
    return linear + quadratic * density * std::abs(superficial);
  }
};
struct Panel {
  Vec3 low, high;  // m; equal along the normal
  std::variant<Baffle, Plate> kind;
};

}  // namespace bedflow
