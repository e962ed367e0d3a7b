#include "gas/pressure.h"

#include <cmath>

namespace bedflow {

PressureCorrection::PressureCorrection(const Decomposition& decomposition, const Grid& grid, Halo& halo,
                                       const Boundaries& boundaries, Preconditioner preconditioner, Workspace& work, int upright)
    : decomposition_(decomposition),
      grid_(grid),
      halo_(halo),
      boundaries_(boundaries),
      open_(boundaries.open()),
      matrix_(grid),
      solver_(decomposition, grid, halo, preconditioner, work, upright),
      correction_(work[3]),
      residual_(work[4]),
      row_sum_(grid) {}

void PressureCorrection::assemble(const Field& fraction, bool renew) {
  for (int d = 0; d < 3; ++d) {
    const double half_area = 0.5 * grid_.face_area(d);
    const std::ptrdiff_t s = grid_.stride(d);
    const double* epsilon = fraction.data();
    double* coupling = matrix_.coupling[d].data();
    Int3 high = grid_.cells;
    ++high[d];
    for_joined_rows(grid_, {0, 0, 0}, high, [=](auto c, int n) {
      for (auto i = c; i < c + n; ++i) coupling[i] *= half_area * (epsilon[i - s] + epsilon[i]);
    });
    halo_.fill(matrix_.coupling[d]);
  }
  if (renew) solver_.factor(matrix_);
}

void PressureCorrection::set_imbalance(const Field& fraction, const FaceField& velocity, const Field& fraction_rate) {
  const double* e = fraction.data();
  const double *u = velocity[0].data(), *v = velocity[1].data(), *w = velocity[2].data(), *rate = fraction_rate.data();
  const double ax = 0.5 * grid_.face_area(0), ay = 0.5 * grid_.face_area(1), az = 0.5 * grid_.face_area(2);
  const double volume = grid_.cell_volume();
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2);
  double* residual = residual_.data();
  for_joined_rows(grid_, [=](auto first, int n) {
#pragma GCC ivdep
    for (auto c = first; c < first + n; ++c)
      residual[c] = ax * ((e[c - 1] + e[c]) * u[c] - (e[c] + e[c + 1]) * u[c + 1]) +
                    ay * ((e[c - sy] + e[c]) * v[c] - (e[c] + e[c + sy]) * v[c + sy]) +
                    az * ((e[c - sz] + e[c]) * w[c] - (e[c] + e[c + sz]) * w[c + sz]) - volume * rate[c];
  });
}

PressureCorrection::Result PressureCorrection::solve(double reduction, double enough) {
  const double cells = static_cast<double>(grid_.global[0]) * grid_.global[1] * grid_.global[2];
  Result result;
  const auto [iterations, reached] = solver_.solve(matrix_, !open_, residual_, correction_, reduction, enough * enough * cells);
  result.iterations = iterations;
  result.reached = reached;
  const double* r = residual_.data();
  double* partial = row_sum_.clear();
  for_joined_rows(grid_, [=](auto c, int n) {
    for (int i = 0; i < n; ++i) partial[i] += std::abs(r[c + i]);
  });
  result.imbalance = decomposition_.comm().sum(row_sum_.total(grid_.cells[0]));
  return result;
}

void PressureCorrection::correct(FaceField& velocity, Field& pressure, const Field& fraction, double share) {
  halo_.fill(correction_);
  const double *x = correction_.data(), *epsilon = fraction.data();
  for (int d = 0; d < 3; ++d) {
    const std::ptrdiff_t s = grid_.stride(d);
    const double half_area = 0.5 * grid_.face_area(d);
    const double* coupling = matrix_.coupling[d].data();
    double* u = velocity[d].data();
    Int3 low{0, 0, 0}, high = grid_.cells;
    low[d] = boundaries_.first_solved(d);
    high[d] = boundaries_.last_solved(d) + 1;
    for_rows(grid_, low, high, [=](auto c, int n) {
      for (auto i = c; i < c + n; ++i) u[i] += coupling[i] * (x[i - s] - x[i]) / (half_area * (epsilon[i - s] + epsilon[i]));
    });
  }
  double* p = pressure.data();
  for_rows(grid_, [=](auto c, int n) {
    for (auto i = c; i < c + n; ++i) p[i] += share * x[i];
  });
}

}  // namespace bedflow
