#include "plan_cost.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/sphere.h"

namespace bedflow {

namespace {

// Measured on one core (deploy/bench.sh dem, transfer and gas print them anew, trade holds the sum of them against runs); they
// make the estimate of the wall time and the balance between ranks.
constexpr double particle_substep_seconds = 9e-9;  // motion, walls
constexpr double pair_substep_seconds = 4.4e-9;    // a listed pair, about every second touches: found, swept, listed
constexpr double history_factor = 2;               // of a pair
constexpr double resting_pairs = 3.7;              // listed, a particle far from surfaces
constexpr double surface_share = 0.25;             // of its pairs that a particle lacks at a surface, of close spheres 3 of 12
constexpr double resting_fraction = 0.6;           // of solids
constexpr double fluidized_pairs = 1.05;
constexpr double particle_step_seconds = 0.036e-6;  // to the grid and back
constexpr double cell_step_seconds = 0.125e-6;      // two outer iterations of SIMPLE, in a bed whose drag holds the gas
constexpr double clear_cell_seconds = 0.22e-6;      // without
constexpr double projection_cell_seconds = 0.13e-6;
constexpr double start_seconds = 0.02;                        // of the process
constexpr double plot_file_seconds = 1.5e-3;                  // laid out
constexpr double process_bytes = 27e6;                        // with MPI and HDF5, before it holds anything
constexpr double particle_bytes = 580;                        // rows, list and what rebuilding takes, five contacts each
constexpr double moved_bytes = 150;                           // of it what motion alone touches
constexpr double history_bytes = 480;                         // more where contacts remember
constexpr double coupled_particle_bytes = 300;                // stencils, weights, what is sampled
constexpr double cell_fields = 44, coupled_cell_fields = 50;  // of gas and pressure solver, and of the exchange
constexpr double cache_bytes = 50e6;
constexpr double contact_bytes = 64;                                // in a checkpoint
constexpr double fluidized_contacts = 0.5, resting_contacts = 2.5;  // a particle, with history

// How much dearer a sweep gets over more than a core has of the cache (100 000 to a million particles, 64³ to 128³ cells).
double beyond_cache(double bytes) {
  return std::clamp(1 + 0.4 * std::log2(bytes / cache_bytes), 1.0, 2.2);
}

// Mean over a run of the share of particles that lie on the ground: those that fall from all heights land as t², until `fall`
// (of the run's time) has passed.
double landed(double fall) {
  return fall < 1 ? 1 - 2 * fall / 3 : 1 / (3 * fall * fall);
}

// Share of their pairs that particles at rest keep: in a heap of few layers many lie at its surfaces.
double kept_pairs(const Plan& plan, double particles) {
  const Scene& scene = plan.scene;
  const double d = scene.particles->largest(), volume = particles * sphere_volume(d) / resting_fraction;
  Vec3 heap = scene.size;
  if (plan.tall >= 0) heap[plan.tall] *= std::min(1.0, volume / (scene.size.x * scene.size.y * scene.size.z));
  double lacking = 0;
  for (int t = 0; t < 3; ++t)
    if (!scene.periodic[t]) lacking += surface_share * std::min(1.0, 2 * d / heap[t]);
  return 1 - std::min(1.0, lacking);
}

}  // namespace

void plan_cost(Plan& plan) {
  const Scene& scene = plan.scene;
  const bool history = scene.particles && scene.particles->laws.history();
  const bool rotation = scene.particles && scene.particles->laws.rotation();
  const auto cells = static_cast<double>(plan.cell_count);
  const auto particles = static_cast<double>(plan.particle_count + plan.entering);  // at most: some leave
  const double field = cells > 0 ? cells * sizeof(double) : 0;
  const double gas_bytes = field * (scene.coupling ? coupled_cell_fields : cell_fields);
  const double dem_bytes = particles * (particle_bytes + (history ? history_bytes : 0));
  plan.memory_bytes =
      process_bytes * plan.ranks + gas_bytes + dem_bytes + (scene.coupling ? particles * coupled_particle_bytes : 0);
  const double contacts = !history ? 0 : scene.coupling ? fluidized_contacts : resting_contacts;
  plan.checkpoint_bytes = 30e3 + field * 5 + particles * (8 + 24.0 * (rotation ? 4 : 3) + contacts * contact_bytes);
  const auto steps = static_cast<double>(plan.steps);
  const bool projection = scene.gas && scene.gas->setup.method == GasMethod::projection;
  StepCost& cost = plan.cost;
  cost.cell = projection ? projection_cell_seconds : scene.coupling ? cell_step_seconds : clear_cell_seconds;
  cost.particle = plan.substeps * particle_substep_seconds + (scene.coupling ? particle_step_seconds : 0);
  cost.pair = plan.substeps * pair_substep_seconds * (history ? history_factor : 1);
  const double at_rest = scene.particles ? resting_pairs * kept_pairs(plan, particles) : 0;
  const bool falls = scene.particles && !scene.particles->settling && !scene.coupling;
  const double pairs = scene.coupling ? fluidized_pairs : falls ? landed(plan.fall_time / scene.end_time) * at_rest : at_rest;
  const auto particle_seconds = [&](double listed) {  // a step
    const double touched = moved_bytes + listed / resting_pairs * (dem_bytes / particles - moved_bytes);
    return beyond_cache(particles * touched / plan.ranks) * (cost.particle + listed * cost.pair);
  };
  plan.seconds = steps * cells * cost.cell * beyond_cache(gas_bytes / plan.ranks);
  if (particles > 0) plan.seconds += steps * particles * particle_seconds(pairs);
  if (scene.particles && scene.particles->settling) {
    const double settled = std::min(1.2 * plan.fall_time, scene.particles->settling->duration);  // at rest soon after
    plan.seconds += settled / plan.step * particles * particle_seconds(0.5 * at_rest);
  }
  const double files = scene.plot_interval ? scene.end_time / *scene.plot_interval : 0;
  plan.seconds = start_seconds + files * plot_file_seconds + plan.seconds / plan.ranks;
}

}  // namespace bedflow
