#include "gas/simple.h"

#include <array>
#include <cmath>
#include <sstream>

#include "gas/boundaries.h"
#include "gas/momentum.h"
#include "gas/pressure.h"

namespace bedflow {

namespace {

template <class... Parts>
std::string join(const Parts&... parts) {
  std::ostringstream text;
  text.precision(3);
  (text << ... << parts);
  return text.str();
}

}  // namespace

struct Simple::Work {
  Work(const Decomposition& given_decomposition, const Grid& given_grid, Halo& given_halo, const GasSetup& given_setup,
       PhaseTimer& given_timer)
      : decomposition(given_decomposition),
        grid(given_grid),
        halo(given_halo),
        setup(given_setup),
        timer(given_timer),
        boundaries(decomposition, grid, setup.faces),
        momentum(decomposition, grid, halo, setup, boundaries),
        pressure(decomposition, grid, halo, boundaries, setup.preconditioner),
        old_velocity(grid),
        old_pressure(grid) {}

  // All that a step takes as given, at its end's time; ghosts right everywhere.
  void set_boundaries(GasState& state, double time, bool pressure_on_face);
  // Present rates, and Σ|∂ε/∂t| V.
  void measure(const GasState& state);
  // Why a box without outflow cannot take this step; empty: it can.
  std::string closed_box_fault(double dt) const;
  GasOutcome iterate(GasState& state, const Exchange* exchange, double dt);
  void restore(GasState& state) const {
    state.velocity = old_velocity;
    state.pressure = old_pressure;
  }

  const Decomposition& decomposition;
  const Grid& grid;
  Halo& halo;
  const GasSetup setup;
  PhaseTimer& timer;
  Boundaries boundaries;
  Momentum momentum;
  PressureCorrection pressure;
  FaceField old_velocity;
  Field old_pressure;
  GasBalance balance;
  double displacement = 0;  // Σ|∂ε/∂t| V, m³/s
};

void Simple::Work::set_boundaries(GasState& state, double time, bool pressure_on_face) {
  boundaries.continue_field(state.fraction);
  halo.fill(state.fraction);
  boundaries.set_normal_velocity(state.velocity, state.fraction, time);
  boundaries.set_velocity_beyond(state.velocity);
  halo.fill(state.velocity);
  boundaries.set_pressure(state.pressure, pressure_on_face);
  halo.fill(state.pressure);
}

void Simple::Work::measure(const GasState& state) {
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
  for_rows(grid, [&](auto first, int n) {
    for (auto c = first; c < first + n; ++c) {
      sums[2] += grid.cell_volume() * rate[c];
      sums[3] += grid.cell_volume() * std::abs(rate[c]);
    }
  });
  decomposition.comm().sum(sums);
  balance = {sums[0], sums[1], sums[2]};
  displacement = sums[3];
}

// The second term: ∂ε/∂t comes from the difference of two ε, each right to round-off.
std::string Simple::Work::closed_box_fault(double dt) const {
  if (boundaries.open()) return {};
  const double net = balance.in - balance.out - balance.storage;
  const Vec3 size = decomposition.size();
  const double allowed = setup.tolerance * (balance.in + balance.out + displacement) + 1e-12 * size.x * size.y * size.z / dt;
  if (std::abs(net) <= allowed) return {};
  if (!std::isfinite(net)) return "the gas fraction or its rate of change is not finite";
  return join("the box has no outflow and cannot balance: inflow ", balance.in - balance.out,
              " m3/s, growth of the gas volume (d eps/dt) ", balance.storage, " m3/s; make one face an outflow");
}

GasOutcome Simple::Work::iterate(GasState& state, const Exchange* exchange, double dt) {
  const auto cells = static_cast<std::uint64_t>(grid.interior());
  const Comm& comm = decomposition.comm();
  GasOutcome outcome;
  {
    const PhaseTimer::Scope scope(timer, Phase::momentum);
    const bool sound = momentum.begin(state, old_velocity, exchange, dt);
    if (comm.any(!sound)) {
      outcome.reason =
          "the gas fraction at the step's start, or the gas share of the pressure force (1 - buoyancy), is not "
          "positive in some cell";
      return outcome;
    }
  }
  double continuity = 0;  // Σ|imbalance|, m³/s, after the last correction
  for (;; ++outcome.iterations) {
    std::array<double, 3> sums{};
    double coupling = 0;
    {
      const PhaseTimer::Scope scope(timer, Phase::momentum, cells);
      const Momentum::Sums mine = momentum.assemble(state);
      sums = {mine.imbalance, mine.force, mine.throughput};
      comm.sum(sums);
      coupling = comm.max(mine.coupling);
    }
    const double throughput = sums[2] + displacement;
    outcome.momentum_residual = sums[0] == 0 ? 0 : sums[0] / sums[1];
    outcome.continuity_residual = continuity == 0 ? 0 : continuity / throughput;
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
    {
      const PhaseTimer::Scope scope(timer, Phase::momentum);
      momentum.solve(state.velocity, coupling);
    }
    const PhaseTimer::Scope scope(timer, Phase::pressure, cells);
    pressure.assemble(momentum.fraction(), momentum.mobility());
    pressure.set_imbalance(momentum.fraction(), state.velocity, state.fraction_rate);
    const double all_cells = static_cast<double>(grid.global[0]) * grid.global[1] * grid.global[2];
    const auto result = pressure.solve(setup.pressure_tolerance, 0.1 * setup.tolerance * throughput / all_cells);
    outcome.pressure_iterations += result.iterations;
    continuity = result.imbalance;
    pressure.correct(state.velocity, state.pressure, momentum.mobility(), setup.pressure_relaxation);
    boundaries.set_velocity_beyond(state.velocity);
    halo.fill(state.velocity);
    halo.fill(state.pressure);
  }
}

Simple::Simple(const Decomposition& decomposition, const Grid& grid, Halo& halo, const GasSetup& setup, PhaseTimer& timer)
    : work_(std::make_unique<Work>(decomposition, grid, halo, setup, timer)) {}

Simple::~Simple() = default;

void Simple::prepare(GasState& state, double time) {
  work_->set_boundaries(state, time, false);
  work_->measure(state);
}

GasOutcome Simple::advance(GasState& state, const Exchange* exchange, double time, double dt) {
  Work& w = *work_;
  w.old_velocity = state.velocity;
  w.old_pressure = state.pressure;
  const GasBalance old_balance = w.balance;
  GasOutcome outcome;
  w.set_boundaries(state, time + dt, true);
  w.measure(state);
  outcome.reason = w.closed_box_fault(dt);
  if (outcome.reason.empty()) outcome = w.iterate(state, exchange, dt);
  if (!outcome.converged) {
    w.restore(state);
    w.balance = old_balance;
    return outcome;
  }
  w.boundaries.set_pressure(state.pressure, false);
  w.halo.fill(state.pressure);
  w.measure(state);
  return outcome;
}

GasBalance Simple::balance() const {
  return work_->balance;
}

Simple::Range Simple::solved_faces(int d) const {
  return {work_->boundaries.first_solved(d), work_->boundaries.last_solved(d)};
}

}  // namespace bedflow
