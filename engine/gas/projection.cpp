// Incremental projection (Van Kan 1986) with the drag in it: momentum once, with the pressure of the step's start, then once the
// pressure,
//
//   (T + C) u* = T' u* + … + ε_b A (p°_low − p°_high),      C u = C u* + ε_b A (p'_low − p'_high),      p = p° + p'
//
// C: inertia, drag and wall shear of a face; T, T': transport to itself and from its neighbours, with the fluxes of the step's
// start; p' such that ∂ε/∂t + ∇·(εU) = 0. Drag acts on the U of the step's end, whatever its share of C: a bed of any drag is
// stable, and what it takes from the gas is what the particles are given. First order in time; what it leaves out of backward
// Euler, transport of U − u*, is of second order in a step, and nothing in a steady state.
#include <cmath>

#include "gas/gas_step.h"

namespace bedflow {

GasOutcome GasStep::projection(GasState& state, const Momentum::Given& given) {
  GasOutcome outcome;
  const MomentumOutcome moved = solve_momentum(state, given, setup.tolerance);
  const double throughput = moved.sums.throughput;
  if (!moved.fault.empty()) {
    outcome.reason = moved.fault + " at the step's start";
    return outcome;
  }
  outcome.momentum_residual = moved.left;
  if (outcome.momentum_residual > setup.tolerance) {
    outcome.reason = join("gas is carried too far in the step: the momentum solve leaves up to ", outcome.momentum_residual,
                          " of the change of velocity; wanted ", setup.tolerance);
    return outcome;
  }
  const auto result = correct(state, setup.pressure_tolerance * throughput, 1);
  outcome.iterations = 1;
  outcome.pressure_iterations = result.iterations;
  outcome.continuity_residual = result.imbalance == 0 ? 0 : result.imbalance / throughput;
  outcome.converged = std::isfinite(result.imbalance) && (result.reached || outcome.continuity_residual <= setup.tolerance);
  if (!outcome.converged) {
    outcome.reason = std::isfinite(outcome.continuity_residual)
                         ? join("the pressure solve left a residual of continuity of ", outcome.continuity_residual, " after ",
                                result.iterations, " iterations; wanted ", setup.tolerance)
                         : std::string("velocity or pressure is not finite after the pressure solve");
  }
  return outcome;
}

}  // namespace bedflow
