// What a scene requires, derived before anything is built. The engine builds only what is on here.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene.h"

namespace bedflow {

struct PlanItem {
  std::string part;
  bool on = false;
  std::string why;
};

// Seconds of a step on one core of the machine of engine/README.md's figures.
struct StepCost {
  double cell = 0;      // of the gas
  double particle = 0;  // all its sub-steps, to the grid and back
  double pair = 0;      // of the pair list, all its sub-steps
};

struct Plan {
  Scene scene;
  int ranks = 1;

  double step = 0;              // dt_CFD at the start, s
  double longest_step = 0;      // s
  double shortest_step = 0;     // s
  double substep = 0;           // dt_DEM, the longest, s; 0 without particles
  std::vector<double> corners;  // times that gas steps end on, in order; the last is the end, s
  double skin = 0;              // of the pair list, m
  bool tuned_skin = false;      // that is the widest, and the run tunes it
  Int3 cells{};                 // of the decomposition: the gas grid's, or blocks wide enough for particles alone
  Int3 narrowest{1, 1, 1};      // fewest cells of a rank's block a direction
  int ghosts = 1;               // layers of the gas grid
  int tall = -1;                // direction that is cut last among ranks
  double fall_time = 0;         // s, a seeded particle's to the other side of the box; 0 without gravity
  double drag_limit = 0;        // 2m/b at the heaviest drag in sight, s; 0 without coupling

  double cell_ratio = 0;  // Δ*; 0 unless gas and particles
  std::int64_t cell_count = 0, particle_count = 0, steps = 0;
  std::int64_t entering = 0;  // particles until the end
  int substeps = 0;           // per step
  StepCost cost;
  int balance_steps = 200;  // between two looks at where the cuts between the blocks stand
  double memory_bytes = 0, checkpoint_bytes = 0, seconds = 0;
  std::vector<PlanItem> items;
  std::vector<std::string> warnings;

  std::string text() const;
};

// Throws Stop(invalid_case) naming the fields when the scene cannot be run stably or on so many ranks.
Plan make_plan(const Scene& scene, int ranks);

}  // namespace bedflow
