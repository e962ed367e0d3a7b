// summary.json: what a run cost.
#pragma once

#include <cstdint>
#include <filesystem>

#include "base/phase_timer.h"
#include "base/stop.h"
#include "parallel/comm.h"
#include "particles/sizes.h"
#include "particles/turnover.h"
#include "plan.h"

namespace bedflow {

struct RunTotals {
  Reason reason = Reason::finished;
  std::uint64_t steps = 0, substeps = 0;  // of this attempt
  double simulated_seconds = 0;           // of this attempt
  double settling_seconds = 0;            // wall, before the steps
  double cpu_seconds = 0;                 // of this rank since the first step, checkpoints and output with it
  std::uint64_t particle_steps = 0;       // all ranks
  std::uint64_t particle_substeps = 0;    // all ranks
  std::uint64_t cell_steps = 0;           // all ranks
  std::int64_t particles = 0;             // at the end
  std::vector<SizeMoments> sizes;         // of these, a type
  Turnover turnover;
  double mass_due = 0;              // kg of particles that found no room to enter yet
  std::uint64_t blocked_steps = 0;  // in which one found none, of all inlets
  std::uint64_t list_rebuilds = 0, gas_iterations = 0, pressure_iterations = 0;
  std::uint64_t block_moves = 0;  // of the cuts between blocks
  double step_seconds = 0;        // wall, of this rank in steps
  Traffic traffic;                // of this rank in steps
};

// Collective; rank 0 writes. Wall and CPU seconds, steps, sub-steps, and seconds and nanoseconds per unit of work of every phase,
// per rank and in total (the ranks' mean); the share of communication (waiting included) in the steps, and their balance: the
// work of the busiest rank over the ranks' mean, where work is what is not communication. Throws std::system_error on rank 0.
void write_summary(const Comm& comm, const std::filesystem::path& path, const Plan& plan, const PhaseTimer& timer,
                   const RunTotals& totals);

}  // namespace bedflow
