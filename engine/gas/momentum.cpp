#include "gas/momentum.h"

#include <algorithm>
#include <cmath>

namespace bedflow {

namespace {

constexpr int most_sweeps = 200;

}  // namespace

Momentum::Momentum(const Decomposition& decomposition, const Grid& grid, Halo& halo, const GasSetup& setup,
                   const Boundaries& boundaries, const Panels& panels, Workspace& work, FaceField& mobility)
    : decomposition_(decomposition),
      grid_(grid),
      halo_(halo),
      setup_(setup),
      boundaries_(boundaries),
      panels_(panels),
      flux_(grid),
      divergence_(grid),
      neighbour_{&work[0], &work[1], &work[2], &work[3], &work[4], &work[5]},
      diagonal_(work[6]),
      source_(work[7]),
      constant_(work[8]),
      mobility_(mobility),
      row_sums_{RowSum(grid), RowSum(grid), RowSum(grid)},
      largest_(grid),
      row_(static_cast<std::size_t>(grid.cells[0]) + 1),
      carry_(static_cast<std::size_t>(grid.cells[0]) + 1) {
  if (ghosts_of(setup.convection) > 1) correction_ = Field(grid);
}

Int3 Momentum::low_solved(int d) const {
  Int3 low{0, 0, 0};
  low[d] = boundaries_.first_solved(d);
  return low;
}

Int3 Momentum::high_solved(int d) const {
  Int3 high = grid_.cells;
  high[d] = boundaries_.last_solved(d) + 1;
  return high;
}

// The diagonal without transport, what of the source does not change over outer iterations, and ε_b A, 0 where no velocity is
// solved. Returns how many faces are unsound.
double Momentum::begin_component(int d, const GasState& state, const Given& given) {
  const std::ptrdiff_t s = grid_.stride(d);
  const double dt = given.dt, inertia = 0.5 * setup_.density * grid_.cell_volume() / dt, area = grid_.face_area(d);
  const double weight = setup_.density * setup_.gravity[d] * grid_.cell_volume();
  const double *epsilon = state.fraction.data(), *rate = state.fraction_rate.data(), *u = (*given.old_velocity)[d].data();
  const Exchange* exchange = given.exchange;
  const double* drag = exchange ? exchange->drag[d].data() : nullptr;
  const double* momentum = exchange ? exchange->drag_momentum[d].data() : nullptr;
  const double* buoyancy = exchange ? exchange->buoyancy[d].data() : nullptr;
  double *local = diagonal_.data(), *constant = constant_.data(), *push = mobility_[d].data();
  double* unsound = row_sums_[0].clear();
  const auto forces = [=, this](Int3 from, Int3 to, double share) {  // share: of a cell that the control volume is
    for_volumes(d, from, to, [=](auto first, int n) {
      const auto row = [=](auto mass_at, auto force_at, auto gas_at) {
#pragma GCC ivdep
        for (int i = 0; i < n; ++i) {
          const std::ptrdiff_t c = first + i;
          const double mass = share * inertia * ((epsilon[c - s] - dt * rate[c - s]) + (epsilon[c] - dt * rate[c]));
          const double gas = gas_at(c);
          local[c] = mass + mass_at(c);
          constant[c] = mass * u[c] + share * gas * weight + force_at(c);
          push[c] = area * gas;
          unsound[i] += gas <= 0 || local[c] <= 0 ? 1 : 0;
        }
      };
      if (exchange) {
        row([=](auto c) { return drag[c]; }, [=](auto c) { return momentum[c]; }, [=](auto c) { return 1 - buoyancy[c]; });
      } else {
        row([](auto) { return 0.0; }, [](auto) { return 0.0; }, [](auto) { return 1.0; });
      }
    });
  };
  Int3 low = low_solved(d), inside = high_solved(d), edge = inside;
  if (boundaries_.outflow(d, 0)) {
    edge[d] = 1;
    forces(low, edge, 0.5);
    low[d] = 1;
  }
  if (boundaries_.outflow(d, 1)) {
    Int3 last = low;
    last[d] = inside[d] - 1;
    forces(last, inside, 0.5);
    --inside[d];
  }
  forces(low, inside, 1);
  for (int side = 0; side < 2; ++side) {  // no momentum is solved on faces of the box that are closed
    if (!boundaries_.at(d, side) || boundaries_.outflow(d, side)) continue;
    Int3 first{0, 0, 0}, end = grid_.cells;
    first[d] = side == 0 ? 0 : grid_.cells[d];
    end[d] = first[d] + 1;
    for_rows(grid_, first, end, [=](auto c, int n) { std::fill_n(push + c, n, 0.0); });
  }
  for (const std::ptrdiff_t face : panels_.closed[d]) constant[face] = push[face] = 0;  // no force counts there
  return row_sums_[0].total(high_solved(d)[0] - low_solved(d)[0]);
}

// ρg ε u A through every face, ghosts included, and ∇·U in every cell of which both faces are at hand.
void Momentum::set_fluxes(const GasState& state) {
  const auto size = static_cast<std::ptrdiff_t>(grid_.size());
  const double* epsilon = state.fraction.data();
  for (int d = 0; d < 3; ++d) {
    const double scale = 0.5 * setup_.density * grid_.face_area(d);
    const double* u = state.velocity[d].data();
    const std::ptrdiff_t s = grid_.stride(d);
    double* flux = flux_[d].data();
    for (std::ptrdiff_t i = s; i < size; ++i) flux[i] = scale * (epsilon[i - s] + epsilon[i]) * u[i];
    if (grid_.ghosts == 1) halo_.fill(flux_[d]);  // of the first layer, before which there is no ε
  }
  const double *u = state.velocity[0].data(), *v = state.velocity[1].data(), *w = state.velocity[2].data();
  const double rx = 1 / grid_.spacing.x, ry = 1 / grid_.spacing.y, rz = 1 / grid_.spacing.z;
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2);
  double* divergence = divergence_.data();
  for_joined_rows(grid_, {-1, -1, -1}, grid_.cells, [=](auto c, int n) {
    for (auto i = c; i < c + n; ++i) divergence[i] = rx * (u[i + 1] - u[i]) + ry * (v[i + sy] - v[i]) + rz * (w[i + sz] - w[i]);
  });
}

Momentum::Sums Momentum::assemble(int d, const GasState& state, const Given& given) {
  const double *p = state.pressure.data(), *u = state.velocity[d].data();
  Sums sums;
  sums.unsound = begin_component(d, state, given);
  assemble_inside(d, p, state.fall[d] * grid_.spacing[d]);
  for (int side = 0; side < 2; ++side)
    if (boundaries_.outflow(d, side)) assemble_outflow(d, side, p);
  for (int t = 0; t < 3; ++t)
    for (int side = 0; side < 2; ++side)
      if (t != d && boundaries_.at(t, side)) apply_boundary(d, t, side);
  correct_convection(d, u);
  apply_panels(d, state);
  relax(d, state, sums);
  return sums;
}

// Faces with a whole control volume, as if there were no boundaries beside them. fall: of pressure from cell to cell, beside p's.
void Momentum::assemble_inside(int d, const double* p, double fall) {
  const int t1 = (d + 1) % 3, t2 = (d + 2) % 3;
  const std::ptrdiff_t s = grid_.stride(d), s1 = grid_.stride(t1), s2 = grid_.stride(t2);
  const double mu = setup_.viscosity, volume = grid_.cell_volume();
  const auto diffusion = [&](int t) { return mu * volume / (grid_.spacing[t] * grid_.spacing[t]); };
  const double along = diffusion(d), across1 = diffusion(t1), across2 = diffusion(t2), dilatation = mu * grid_.face_area(d) / 3;
  const double *f = flux_[d].data(), *f1 = flux_[t1].data(), *f2 = flux_[t2].data(), *divergence = divergence_.data();
  const double *constant = constant_.data(), *push = mobility_[d].data();
  double *low = neighbour_[2 * d]->data(), *high = neighbour_[2 * d + 1]->data();
  double *low1 = neighbour_[2 * t1]->data(), *high1 = neighbour_[2 * t1 + 1]->data();
  double *low2 = neighbour_[2 * t2]->data(), *high2 = neighbour_[2 * t2 + 1]->data();
  double* source = source_.data();
  Int3 from{0, 0, 0};
  from[d] = boundaries_.at(d, 0) ? 1 : 0;
  for_volumes(d, from, grid_.cells, [=](auto first, int n) {
#pragma GCC ivdep
    for (auto c = first; c < first + n; ++c) {
      low[c] = along + std::max(0.5 * (f[c - s] + f[c]), 0.0);
      high[c] = along + std::max(-0.5 * (f[c] + f[c + s]), 0.0);
      low1[c] = across1 + std::max(0.5 * (f1[c - s] + f1[c]), 0.0);
      high1[c] = across1 + std::max(-0.5 * (f1[c - s + s1] + f1[c + s1]), 0.0);
      low2[c] = across2 + std::max(0.5 * (f2[c - s] + f2[c]), 0.0);
      high2[c] = across2 + std::max(-0.5 * (f2[c - s + s2] + f2[c + s2]), 0.0);
      source[c] = constant[c] + push[c] * (p[c - s] - p[c] + fall) + dilatation * (divergence[c] - divergence[c - s]);
    }
  });
}

// To the row above in z; none above the faces of an outflow there, which the field ends with (and whose coefficient is 0).
std::ptrdiff_t Momentum::step_above(std::ptrdiff_t row, int n) const {
  const std::ptrdiff_t sz = grid_.stride(2);
  return row + n + sz <= static_cast<std::ptrdiff_t>(grid_.size()) ? sz : 0;
}

// Residual of the equations as they are; then Σa/α on the diagonal, the diagonal inverted, and the mobility.
void Momentum::relax(int d, const GasState& state, Sums& sums) {
  const double *a0 = neighbour_[0]->data(), *a1 = neighbour_[1]->data(), *a2 = neighbour_[2]->data(), *a3 = neighbour_[3]->data(),
               *a4 = neighbour_[4]->data(), *a5 = neighbour_[5]->data();
  double *diagonal = diagonal_.data(), *source = source_.data(), *mobility = mobility_[d].data();
  const double *constant = constant_.data(), *epsilon = state.fraction.data(), *u = state.velocity[d].data();
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2), s = grid_.stride(d);
  const double keep = 1 / setup_.velocity_relaxation - 1;
  // Transport over the whole box instead of over a cell: convection by 1/n, diffusion by 1/n² for n cells.
  const double nx = 1.0 / grid_.global[0], ny = 1.0 / grid_.global[1], nz = 1.0 / grid_.global[2];
  double fine = 0;
  for (int t = 0; t < 3; ++t) {
    const double n = grid_.global[t], diffusion = setup_.viscosity * grid_.cell_volume() / (grid_.spacing[t] * grid_.spacing[t]);
    fine += 2 * diffusion * (1 / n - 1 / (n * n));
  }
  double *coupling = largest_.clear(), *imbalance = row_sums_[0].clear(), *force = row_sums_[1].clear(),
         *throughput = row_sums_[2].clear();
  const Int3 low = low_solved(d), high = high_solved(d);
  for_volumes(d, low, high, [=, this](auto first, int n) {
    const std::ptrdiff_t above = step_above(first, n);
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) {
      const std::ptrdiff_t c = first + i;
      const double transport = a0[c] + a1[c] + a2[c] + a3[c] + a4[c] + a5[c];
      const double brought =
          a0[c] * u[c - 1] + a1[c] * u[c + 1] + a2[c] * u[c - sy] + a3[c] * u[c + sy] + a4[c] * u[c - sz] + a5[c] * u[c + above];
      const double lack = source[c] + brought - (diagonal[c] + transport) * u[c];
      const double here = diagonal[c] * u[c] - constant[c];
      const double carried = std::max(nx * (a0[c] + a1[c]) + ny * (a2[c] + a3[c]) + nz * (a4[c] + a5[c]) - fine, 0.0);
      const double acting = std::abs(source[c] - constant[c]) + std::abs(here) + carried * std::abs(u[c]) + std::abs(lack);
      const double still = diagonal[c] + keep * transport;
      const double inverse = 1 / (still + transport);
      imbalance[i] += std::abs(lack);
      force[i] += acting;
      throughput[i] += 0.5 * (epsilon[c - s] + epsilon[c]) * (std::abs(u[c]) + acting * inverse);
      source[c] += keep * transport * u[c];
      diagonal[c] = inverse;
      coupling[i] = std::max(coupling[i], transport * inverse);
      mobility[c] /= still;
    }
  });
  for_gaps(grid_, low, high, [=](auto c, int n) { std::fill_n(mobility + c, n, 0.0); });  // nothing is solved there
  const int solved = high[0] - low[0];
  sums.imbalance = row_sums_[0].total(solved);
  sums.force = row_sums_[1].total(solved);
  sums.coupling = largest_.largest(solved);
  sums.throughput = row_sums_[2].total(solved) * grid_.face_area(d) / grid_.global[d];
}

// A sweep takes the largest error down to `coupling` of what it was at least, and in the end to about its square.
double Momentum::solve(int d, Field& velocity, double coupling, double leave) {
  const double each = std::log(coupling < 0.999 ? std::max(coupling, 1e-9) : 0.999);  // also of what is not finite
  const int sweeps = std::clamp(static_cast<int>(std::ceil(std::log(leave) / each)), 1, most_sweeps);
  for (int n = 0; n < sweeps; ++n) {
    sweep(d, n % 2 == 0 ? 1 : -1, velocity.data());
    halo_.fill(velocity);
  }
  return std::exp(sweeps * each);
}

// One Gauss–Seidel sweep; within a row all but the neighbour just done is gathered first.
void Momentum::sweep(int d, int direction, double* u) {
  const double *a0 = neighbour_[direction > 0 ? 0 : 1]->data(), *a1 = neighbour_[direction > 0 ? 1 : 0]->data(),
               *a2 = neighbour_[2]->data(), *a3 = neighbour_[3]->data(), *a4 = neighbour_[4]->data(), *a5 = neighbour_[5]->data(),
               *inverse = diagonal_.data(), *source = source_.data();
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2);
  double *row = row_.data(), *carry = carry_.data();
  const Int3 low = low_solved(d), high = high_solved(d);
  const int n = high[0] - low[0];
  if (n <= 0) return;
  const auto sweep_row = [=, this](std::ptrdiff_t c) {
    const std::ptrdiff_t above = step_above(c, n);
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) {
      const std::ptrdiff_t at = c + i;
      row[i] = inverse[at] * (source[at] + a1[at] * u[at + direction] + a2[at] * u[at - sy] + a3[at] * u[at + sy] +
                              a4[at] * u[at - sz] + a5[at] * u[at + above]);
      carry[i] = inverse[at] * a0[at];
    }
    if (direction > 0) {
      double last = u[c - 1];
      for (int i = 0; i < n; ++i) u[c + i] = last = row[i] + carry[i] * last;
    } else {
      double last = u[c + n];
      for (int i = n - 1; i >= 0; --i) u[c + i] = last = row[i] + carry[i] * last;
    }
  };
  if (direction > 0) {
    for (int k = low[2]; k < high[2]; ++k)
      for (int j = low[1]; j < high[1]; ++j) sweep_row(grid_.index(low[0], j, k));
  } else {
    for (int k = high[2] - 1; k >= low[2]; --k)
      for (int j = high[1] - 1; j >= low[1]; --j) sweep_row(grid_.index(low[0], j, k));
  }
}

}  // namespace bedflow
