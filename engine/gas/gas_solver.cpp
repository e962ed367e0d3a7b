#include "gas/gas_solver.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "gas/gas_step.h"

namespace bedflow {

namespace {

GasSetup unrelaxed(GasSetup setup) {
  setup.velocity_relaxation = setup.pressure_relaxation = 1;
  return setup;
}

// The direction of gravity, or the nearest; -1: there is none.
int upright(Vec3 gravity) {
  int direction = -1;
  for (int d = 0; d < 3; ++d)
    if (std::abs(gravity[d]) > (direction < 0 ? 0 : std::abs(gravity[direction]))) direction = d;
  return direction;
}

}  // namespace

// ------------------------------------------------------------------------------------------------ what both ways share

GasStep::GasStep(const Decomposition& given_decomposition, const Grid& given_grid, Halo& given_halo, const GasSetup& given_setup,
                 PhaseTimer& given_timer)
    : decomposition(given_decomposition),
      grid(given_grid),
      halo(given_halo),
      setup(given_setup.method == GasMethod::simple ? given_setup : unrelaxed(given_setup)),
      timer(given_timer),
      boundaries(decomposition, grid, setup.faces),
      panels(grid, decomposition, boundaries, setup.panels),
      work(grid),
      pressure(decomposition, grid, halo, boundaries, setup.preconditioner, work, upright(setup.gravity)),
      momentum(decomposition, grid, halo, setup, boundaries, panels, work, pressure.mobility()),
      driven(decomposition, grid, setup),
      old_velocity(grid),
      old_pressure(grid),
      row_sums{RowSum(grid), RowSum(grid)} {}

void GasStep::set_boundaries(GasState& state, double time, bool pressure_on_face) {
  for (Field* field : {&state.fraction, &state.fraction_rate}) {
    boundaries.continue_field(*field);
    halo.fill(*field);
  }
  boundaries.set_normal_velocity(state.velocity, state.fraction, time);
  panels.close(state.velocity);
  driven.set_time(state, time);
  boundaries.set_velocity_beyond(state.velocity);
  halo.fill(state.velocity);
  boundaries.set_pressure(state.pressure, pressure_on_face);
  halo.fill(state.pressure);
}

void GasStep::measure(const GasState& state) {
  std::array<double, 4> sums{};  // in, out, storage, displacement
  const double* epsilon = state.fraction.data();
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) {
      if (!boundaries.at(d, side)) continue;
      const double* u = state.velocity[d].data();
      const double inward = side == 0 ? grid.face_area(d) : -grid.face_area(d);
      const std::ptrdiff_t before = side == 0 ? 0 : grid.stride(d);
      Int3 low{0, 0, 0}, high = grid.cells;
      low[d] = side == 0 ? 0 : grid.cells[d];
      high[d] = low[d] + 1;
      for_rows(grid, low, high, [&](auto first, int n) {
        for (auto c = first; c < first + n; ++c) {
          const double entering = inward * epsilon[c - before] * u[c];
          sums[entering > 0 ? 0 : 1] += std::abs(entering);
        }
      });
    }
  const double* rate = state.fraction_rate.data();
  double *net = row_sums[0].clear(), *gross = row_sums[1].clear();
  for_joined_rows(grid, [=](auto c, int n) {
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) {
      net[i] += rate[c + i];
      gross[i] += std::abs(rate[c + i]);
    }
  });
  for (int s = 0; s < 2; ++s) sums[2 + s] = grid.cell_volume() * row_sums[s].total(grid.cells[0]);
  decomposition.comm().sum(sums);
  balance = {sums[0], sums[1], sums[2]};
  displacement = sums[3];
}

// The second term: ∂ε/∂t comes from the difference of two ε, each right to round-off.
std::string GasStep::closed_box_fault(double dt) const {
  if (boundaries.open()) return {};
  const double net = balance.in - balance.out - balance.storage;
  const Vec3 size = decomposition.size();
  const double allowed = setup.tolerance * (balance.in + balance.out + displacement) + 1e-12 * size.x * size.y * size.z / dt;
  if (std::abs(net) <= allowed) return {};
  if (!std::isfinite(net)) return "the gas fraction or its rate of change is not finite";
  return join("the box has no outflow and cannot balance: inflow ", balance.in - balance.out,
              " m3/s, growth of the gas volume (d eps/dt) ", balance.storage, " m3/s; make one face an outflow");
}

// The sums of all ranks, and what is wrong with them. Collective.
void GasStep::conclude(MomentumOutcome& outcome) const {
  Momentum::Sums& all = outcome.sums;
  std::array<double, 4> sums{all.imbalance, all.force, all.throughput, all.unsound};
  decomposition.comm().sum(sums);
  all.imbalance = sums[0];
  all.force = sums[1];
  all.throughput = sums[2] + displacement;
  if (sums[3] > 0)
    outcome.fault = "the gas fraction, or the gas share of the pressure force (1 - buoyancy), is not positive in some cell";
  else if (!std::isfinite(all.imbalance) || !std::isfinite(all.throughput))
    outcome.fault = "velocity, pressure or exchange is not finite";
}

GasStep::MomentumOutcome GasStep::check_momentum(const GasState& state, const Momentum::Given& given) {
  const PhaseTimer::Scope scope(timer, Phase::momentum);
  MomentumOutcome outcome;
  momentum.set_fluxes(state);
  for (int d = 0; d < 3; ++d) outcome.sums += momentum.assemble(d, state, given);
  conclude(outcome);
  return outcome;
}

GasStep::MomentumOutcome GasStep::solve_momentum(GasState& state, const Momentum::Given& given, double leave) {
  const PhaseTimer::Scope scope(timer, Phase::momentum, static_cast<std::uint64_t>(grid.interior()));
  MomentumOutcome outcome;
  momentum.set_fluxes(state);
  for (int d = 0; d < 3; ++d) {
    const Momentum::Sums sums = momentum.assemble(d, state, given);
    outcome.sums += sums;
    const double coupling = decomposition.comm().max(sums.coupling);
    outcome.left = std::max(outcome.left, momentum.solve(d, state.velocity[d], coupling, leave));
  }
  conclude(outcome);
  return outcome;
}

PressureCorrection::Result GasStep::correct(GasState& state, double enough, double share, bool renew) {
  const PhaseTimer::Scope scope(timer, Phase::pressure, static_cast<std::uint64_t>(grid.interior()));
  pressure.assemble(state.fraction, renew);
  pressure.set_imbalance(state.fraction, state.velocity, state.fraction_rate);
  const double cells = static_cast<double>(grid.global[0]) * grid.global[1] * grid.global[2];
  const auto result = pressure.solve(setup.pressure_tolerance, enough / cells);
  pressure.correct(state.velocity, state.pressure, state.fraction, share);
  driven.steer(state, pressure.matrix().coupling);
  boundaries.set_velocity_beyond(state.velocity);
  halo.fill(state.velocity);
  halo.fill(state.pressure);
  return result;
}

// ------------------------------------------------------------------------------------------------ one step

GasSolver::GasSolver(const Decomposition& decomposition, const Grid& grid, Halo& halo, const GasSetup& setup, PhaseTimer& timer)
    : step_(std::make_unique<GasStep>(decomposition, grid, halo, setup, timer)) {}

GasSolver::~GasSolver() = default;

void GasSolver::prepare(GasState& state, double time) {
  step_->set_boundaries(state, time, false);
  step_->measure(state);
}

GasOutcome GasSolver::advance(GasState& state, const Exchange* exchange, double time, double dt) {
  GasStep& w = *step_;
  w.old_velocity = state.velocity;
  w.old_pressure = state.pressure;
  w.old_fall = state.fall;
  const GasBalance old_balance = w.balance;
  GasOutcome outcome;
  w.set_boundaries(state, time + dt, true);
  w.measure(state);
  outcome.reason = w.closed_box_fault(dt);
  if (outcome.reason.empty()) {
    const Momentum::Given given{&w.old_velocity, exchange, dt};
    outcome = w.setup.method == GasMethod::simple ? w.simple(state, given) : w.projection(state, given);
  }
  if (!outcome.converged) {
    state.velocity = w.old_velocity;
    state.pressure = w.old_pressure;
    state.fall = w.old_fall;
    w.balance = old_balance;
    return outcome;
  }
  w.panels.set_jumps(state, w.grid, w.setup.density);
  w.boundaries.set_pressure(state.pressure, false);
  w.halo.fill(state.pressure);
  w.measure(state);
  return outcome;
}

GasBalance GasSolver::balance() const {
  return step_->balance;
}

GasSolver::Range GasSolver::solved_faces(int d) const {
  return {step_->boundaries.first_solved(d), step_->boundaries.last_solved(d)};
}

}  // namespace bedflow
