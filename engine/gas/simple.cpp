// SIMPLE (Patankar 1980; multiphase form Syamlal 1998): outer iterations of relaxed momentum and pressure correction until the
// equations, with the coefficients of the step's end, hold.
#include <cmath>

#include "gas/gas_step.h"

namespace bedflow {

GasOutcome GasStep::simple(GasState& state) {
  constexpr double sweeps_leave = 0.3;  // of an error that the next iteration's coefficients change anyway
  GasOutcome outcome;
  double continuity = 0;  // Σ|imbalance|, m³/s, after the last correction
  for (;; ++outcome.iterations) {
    const Momentum::Sums sums = assemble(state);
    outcome.momentum_residual = sums.imbalance == 0 ? 0 : sums.imbalance / sums.force;
    outcome.continuity_residual = continuity == 0 ? 0 : continuity / sums.throughput;
    if (!std::isfinite(outcome.momentum_residual) || !std::isfinite(outcome.continuity_residual)) {
      outcome.reason = outcome.iterations == 0
                           ? std::string("velocity, pressure or exchange is not finite at the step's start")
                           : join("velocity or pressure is not finite after outer iteration ", outcome.iterations);
      return outcome;
    }
    outcome.converged = outcome.iterations >= setup.min_iterations && outcome.momentum_residual <= setup.tolerance &&
                        outcome.continuity_residual <= setup.tolerance;
    if (outcome.converged) return outcome;
    if (outcome.iterations >= setup.max_iterations) {
      outcome.reason = join(outcome.iterations, " outer iterations left residuals of ", outcome.momentum_residual,
                            " (momentum) and ", outcome.continuity_residual, " (continuity); wanted ", setup.tolerance);
      return outcome;
    }
    solve_momentum(state, sums.coupling, sweeps_leave);
    // Far below what continuity may lack: where that were left alone, pressure would stand still and momentum never settle.
    const auto result = correct(state, 0.01 * setup.tolerance * sums.throughput, setup.pressure_relaxation);
    outcome.pressure_iterations += result.iterations;
    continuity = result.imbalance;
  }
}

}  // namespace bedflow
