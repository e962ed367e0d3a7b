// SIMPLE (Patankar 1980; multiphase form Syamlal 1998): outer iterations of relaxed momentum and pressure correction until the
// equations, with the coefficients of the step's end, hold.
#include "gas/gas_step.h"

namespace bedflow {

GasOutcome GasStep::simple(GasState& state, const Momentum::Given& given) {
  constexpr double sweeps_leave = 0.3;  // of an error that the next iteration's coefficients change anyway
  constexpr int renewed = 4;            // iterations for which a preconditioner is good: the coefficients change little
  GasOutcome outcome;
  double continuity = 0;  // Σ|imbalance|, m³/s, after the last correction
  const auto sound = [&](const MomentumOutcome& now) {
    outcome.momentum_residual = now.sums.imbalance == 0 ? 0 : now.sums.imbalance / now.sums.force;
    outcome.continuity_residual = continuity == 0 ? 0 : continuity / now.sums.throughput;
    if (now.fault.empty()) return true;
    outcome.reason = outcome.iterations == 0 ? now.fault + " at the step's start"
                                             : join(now.fault, " after outer iteration ", outcome.iterations);
    return false;
  };
  for (;; ++outcome.iterations) {
    if (outcome.iterations >= setup.min_iterations) {
      if (!sound(check_momentum(state, given))) return outcome;
      outcome.converged = outcome.momentum_residual <= setup.tolerance && outcome.continuity_residual <= setup.tolerance;
      if (outcome.converged) return outcome;
      if (outcome.iterations >= setup.max_iterations) {
        outcome.reason = join(outcome.iterations, " outer iterations left residuals of ", outcome.momentum_residual,
                              " (momentum) and ", outcome.continuity_residual, " (continuity); wanted ", setup.tolerance);
        return outcome;
      }
    }
    const MomentumOutcome now = solve_momentum(state, given, sweeps_leave);
    if (!sound(now)) return outcome;
    // Far below what continuity may lack: where that were left alone, pressure would stand still and momentum never settle.
    const auto result = correct(state, 0.01 * setup.tolerance * now.sums.throughput, setup.pressure_relaxation,
                                outcome.iterations % renewed == 0);
    outcome.pressure_iterations += result.iterations;
    continuity = result.imbalance;
  }
}

}  // namespace bedflow
