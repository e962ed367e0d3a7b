#include "gas/pressure.h"

#include <cmath>
#include <limits>

namespace bedflow {

namespace {

constexpr int most_iterations = 2000;

}  // namespace

PressureCorrection::PressureCorrection(const Decomposition& decomposition, const Grid& grid, Halo& halo,
                                       const Boundaries& boundaries)
    : decomposition_(decomposition),
      grid_(grid),
      halo_(halo),
      boundaries_(boundaries),
      open_(boundaries.open()),
      matrix_(grid),
      preconditioner_(grid),
      correction_(grid),
      residual_(grid),
      preconditioned_(grid),
      direction_(grid),
      product_(grid),
      row_sum_(grid.cells[0]) {}

void PressureCorrection::assemble(const FaceField& fraction, const FaceField& mobility) {
  for (int d = 0; d < 3; ++d) {
    const double area = grid_.face_area(d);
    const double *face = fraction[d].data(), *push = mobility[d].data();
    double* coupling = matrix_.coupling[d].data();
    Int3 high = grid_.cells;
    ++high[d];
    for_rows(grid_, {0, 0, 0}, high, [=](auto c, int n) {
      for (auto i = c; i < c + n; ++i) coupling[i] = area * face[i] * push[i];
    });
    halo_.fill(matrix_.coupling[d]);
  }
  const double *x = matrix_.coupling[0].data(), *y = matrix_.coupling[1].data(), *z = matrix_.coupling[2].data();
  double* diagonal = matrix_.diagonal.data();
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2);
  for_rows(grid_, [=](auto c, int n) {
    for (auto i = c; i < c + n; ++i) diagonal[i] = x[i] + x[i + 1] + y[i] + y[i + sy] + z[i] + z[i + sz];
  });
  // Beyond an outflow p' is 0: the face counts on the diagonal alone.
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) {
      if (!boundaries_.outflow(d, side)) continue;
      Int3 low{0, 0, 0}, high = grid_.cells;
      low[d] = side == 0 ? 0 : grid_.cells[d];
      high[d] = low[d] + 1;
      double* coupling = matrix_.coupling[d].data();
      for_rows(grid_, low, high, [=](auto c, int n) { std::fill(coupling + c, coupling + c + n, 0.0); });
    }
  preconditioner_.factor(matrix_);
}

void PressureCorrection::set_imbalance(const FaceField& fraction, const FaceField& velocity, const Field& fraction_rate) {
  const double *ex = fraction[0].data(), *ey = fraction[1].data(), *ez = fraction[2].data();
  const double *u = velocity[0].data(), *v = velocity[1].data(), *w = velocity[2].data(), *rate = fraction_rate.data();
  const double ax = grid_.face_area(0), ay = grid_.face_area(1), az = grid_.face_area(2), volume = grid_.cell_volume();
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2);
  double* residual = residual_.data();
  for_rows(grid_, [=](auto first, int n) {
    for (auto c = first; c < first + n; ++c)
      residual[c] = ax * (ex[c] * u[c] - ex[c + 1] * u[c + 1]) + ay * (ey[c] * v[c] - ey[c + sy] * v[c + sy]) +
                    az * (ez[c] * w[c] - ez[c + sz] * w[c + sz]) - volume * rate[c];
  });
}

double PressureCorrection::dot(const Field& a, const Field& b) {
  const double *x = a.data(), *y = b.data();
  double* partial = row_sum_.clear();
  for_rows(grid_, [=](auto c, int n) {
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) partial[i] += x[c + i] * y[c + i];
  });
  return decomposition_.comm().sum(row_sum_.total());
}

void PressureCorrection::subtract_mean(Field& field) {
  double* x = field.data();
  double* partial = row_sum_.clear();
  for_rows(grid_, [=](auto c, int n) {
    for (int i = 0; i < n; ++i) partial[i] += x[c + i];
  });
  const double cells = static_cast<double>(grid_.global[0]) * grid_.global[1] * grid_.global[2];
  const double mean = decomposition_.comm().sum(row_sum_.total()) / cells;
  for_rows(grid_, [=](auto c, int n) {
    for (int i = 0; i < n; ++i) x[c + i] -= mean;
  });
}

double PressureCorrection::multiply() {
  halo_.fill(direction_);
  const double *x = matrix_.coupling[0].data(), *y = matrix_.coupling[1].data(), *z = matrix_.coupling[2].data();
  const double *diagonal = matrix_.diagonal.data(), *p = direction_.data();
  double *product = product_.data(), *partial = row_sum_.clear();
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2);
  for_rows(grid_, [=](auto first, int n) {
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) {
      const std::ptrdiff_t c = first + i;
      product[c] = diagonal[c] * p[c] - x[c] * p[c - 1] - x[c + 1] * p[c + 1] - y[c] * p[c - sy] - y[c + sy] * p[c + sy] -
                   z[c] * p[c - sz] - z[c + sz] * p[c + sz];
      partial[i] += p[c] * product[c];
    }
  });
  return row_sum_.total();
}

PressureCorrection::Result PressureCorrection::solve(double reduction, double enough) {
  const Comm& comm = decomposition_.comm();
  double *x = correction_.data(), *r = residual_.data(), *z = preconditioned_.data(), *p = direction_.data();
  const double* q = product_.data();
  correction_.fill(0);
  direction_.fill(0);
  if (!open_) subtract_mean(residual_);
  const double cells = static_cast<double>(grid_.global[0]) * grid_.global[1] * grid_.global[2];
  double squares = dot(residual_, residual_), last = 0;
  const double target = std::max(reduction * reduction * squares, enough * enough * cells);
  Result result;
  while (squares > target && result.iterations < most_iterations) {
    preconditioner_.apply(matrix_, residual_, preconditioned_);
    const double now = dot(residual_, preconditioned_), turn = result.iterations == 0 ? 0 : now / last;
    last = now;
    for_rows(grid_, [=](auto c, int n) {
#pragma GCC ivdep
      for (auto i = c; i < c + n; ++i) p[i] = z[i] + turn * p[i];
    });
    const double curvature = comm.sum(multiply());
    if (!(curvature > 0)) break;  // nothing is left to be gained, or the numbers are not finite
    const double step = now / curvature;
    double* partial = row_sum_.clear();
    for_rows(grid_, [=](auto c, int n) {
#pragma GCC ivdep
      for (int i = 0; i < n; ++i) {
        x[c + i] += step * p[c + i];
        r[c + i] -= step * q[c + i];
        partial[i] += r[c + i] * r[c + i];
      }
    });
    squares = comm.sum(row_sum_.total());
    ++result.iterations;
  }
  if (!open_) subtract_mean(correction_);
  double* partial = row_sum_.clear();
  for_rows(grid_, [=](auto c, int n) {
    for (int i = 0; i < n; ++i) partial[i] += std::abs(r[c + i]);
  });
  result.imbalance = comm.sum(row_sum_.total());
  return result;
}

void PressureCorrection::correct(FaceField& velocity, Field& pressure, const FaceField& mobility, double share) {
  halo_.fill(correction_);
  const double* x = correction_.data();
  for (int d = 0; d < 3; ++d) {
    const std::ptrdiff_t s = grid_.stride(d);
    const double* push = mobility[d].data();
    double* u = velocity[d].data();
    Int3 low{0, 0, 0}, high = grid_.cells;
    low[d] = boundaries_.first_solved(d);
    high[d] = boundaries_.last_solved(d) + 1;
    for_rows(grid_, low, high, [=](auto c, int n) {
      for (auto i = c; i < c + n; ++i) u[i] += push[i] * (x[i - s] - x[i]);
    });
  }
  double* p = pressure.data();
  for_rows(grid_, [=](auto c, int n) {
    for (auto i = c; i < c + n; ++i) p[i] += share * x[i];
  });
}

}  // namespace bedflow
