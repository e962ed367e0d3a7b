// A case as the engine sees it: laws, numbers and places, no protobuf. case/ makes it, plan.* decides what of it is built.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gas/gas_solver.h"
#include "geometry/wall.h"
#include "models/drag.h"
#include "models/exchange.h"
#include "models/kernel.h"
#include "particles/dem.h"
#include "particles/insertion.h"
#include "particles/seeding.h"
#include "statistics/monitors.h"

namespace bedflow {

struct GasScene {
  GasSetup setup;
  Vec3 initial_velocity;                         // m/s
  std::optional<Preconditioner> preconditioner;  // as the case names it; the plan chooses else
};

// Of seeded particles before time 0.
struct Settling {
  double duration = 0;       // s, at most
  double rest_velocity = 0;  // m/s, root mean square
  ContactLaw contact;
};

struct ParticleScene {
  std::vector<SeedKind> kinds;      // types, one at least
  std::vector<ParticleType> types;  // the same, as contacts see them
  std::vector<SeedRegion> regions;  // where they are at time 0
  std::vector<Inlet> inlets;        // where they enter later
  std::optional<Settling> settling;
  double collision_time = 0;       // τ, s: the smallest over pairs and walls
  double steps_per_collision = 0;  // dt_DEM = τ/steps
  double skin = 0;                 // m; 0: chosen by the plan
  ContactLaws laws;
  bool verlet = false;         // velocity Verlet, else symplectic Euler
  double coarse_graining = 1;  // all above is of parcels, so many times as wide as the particles of the case

  double largest() const {  // diameter, m
    double largest = 0;
    for (const ParticleType& type : types) largest = std::max(largest, 2 * type.radius);
    return largest;
  }
};

struct CouplingScene {
  Drag drag;
  Kernel kernel;
  ExchangeScheme scheme;
  bool displacement = true;
  double fraction_floor = 0.35;
};

// Limits of a state beyond which the run stops (guard.h).
struct GuardSetup {
  double overlap = 0.3;     // of a contact, over the sum of the radii, at most
  double move = 0.1;        // of a particle in a sub-step, over its diameter, at most
  double gas_fraction = 0;  // of a cell, before the floor, at least
  double courant = 100;     // at most
  double energy = 0.2;      // that contacts create, over what there is, at most; 0: not watched
  int retries = 0;          // from the last checkpoint, each with half the step
};

struct Scene {
  std::string name;
  Vec3 size;     // m
  Int3 cells{};  // 0 without gas
  std::array<bool, 3> periodic{};
  std::array<std::array<Side, 2>, 3> sides{};  // what the faces are for particles
  Vec3 gravity;                                // m/s²
  std::optional<GasScene> gas;
  std::optional<ParticleScene> particles;
  std::optional<CouplingScene> coupling;
  std::vector<Wall> walls;              // within the box
  double end_time = 0;                  // s
  std::optional<double> step;           // dt_CFD at the start, s; τ if neither this nor substeps is there
  std::optional<int> substeps;          // the same in sub-steps of the particles
  std::optional<double> longest_step;   // s; as step if absent
  std::optional<double> shortest_step;  // s; step/1000 if absent
  std::optional<double> courant;        // Σ|U|dt/h, at most
  std::vector<MonitorSetup> monitors;
  std::optional<double> plot_interval;  // s
  GuardSetup guard;
  std::string fidelity;  // where the case stands between speed and accuracy, for people
};

}  // namespace bedflow
