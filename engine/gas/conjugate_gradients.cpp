#include "gas/conjugate_gradients.h"

#include <algorithm>
#include <cmath>

namespace bedflow {

namespace {

constexpr int most_iterations = 2000;

}  // namespace

ConjugateGradients::ConjugateGradients(const Decomposition& decomposition, const Grid& grid, Halo& halo,
                                       Preconditioner preconditioner, Workspace& work, int upright)
    : decomposition_(decomposition),
      grid_(grid),
      halo_(halo),
      preconditioner_(Identity{}),
      preconditioned_(work[0]),
      direction_(work[1]),
      product_(work[2]),
      row_sum_(grid) {
  if (preconditioner == Preconditioner::multigrid) preconditioner_.emplace<Multigrid>(decomposition, grid, upright);
  if (preconditioner == Preconditioner::incomplete_cholesky) preconditioner_.emplace<IncompleteCholesky>(grid);
}

void ConjugateGradients::factor(const SevenPoint& matrix) {
  if (auto* multigrid = std::get_if<Multigrid>(&preconditioner_)) multigrid->factor(matrix);
  if (auto* cholesky = std::get_if<IncompleteCholesky>(&preconditioner_)) cholesky->factor(matrix);
}

void ConjugateGradients::precondition(const SevenPoint& matrix, const Field& r, double magnitude) {
  if (auto* multigrid = std::get_if<Multigrid>(&preconditioner_))
    multigrid->apply(r, magnitude, preconditioned_);
  else if (auto* cholesky = std::get_if<IncompleteCholesky>(&preconditioner_))
    cholesky->apply(matrix, r, preconditioned_);
  else
    for_rows(grid_, [&](auto c, int n) { std::copy_n(r.data() + c, n, preconditioned_.data() + c); });
}

double ConjugateGradients::dot(const Field& a, const Field& b) {
  const double *x = a.data(), *y = b.data();
  double* partial = row_sum_.clear();
  for_joined_rows(grid_, [=](auto c, int n) {
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) partial[i] += x[c + i] * y[c + i];
  });
  return decomposition_.comm().sum(row_sum_.total(grid_.cells[0]));
}

void ConjugateGradients::subtract_mean(Field& field) {
  double* x = field.data();
  double* partial = row_sum_.clear();
  for_rows(grid_, [=](auto c, int n) {
    for (int i = 0; i < n; ++i) partial[i] += x[c + i];
  });
  const double mean = decomposition_.comm().sum(row_sum_.total(grid_.cells[0])) / cells();
  for_rows(grid_, [=](auto c, int n) {
    for (int i = 0; i < n; ++i) x[c + i] -= mean;
  });
}

double ConjugateGradients::multiply(const SevenPoint& matrix) {
  halo_.fill(direction_);
  const double *x = matrix.coupling[0].data(), *y = matrix.coupling[1].data(), *z = matrix.coupling[2].data();
  const double* p = direction_.data();
  double *product = product_.data(), *partial = row_sum_.clear();
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2);
  for_joined_rows(grid_, [=](auto first, int n) {
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) {
      const std::ptrdiff_t c = first + i;
      product[c] = x[c] * (p[c] - p[c - 1]) + x[c + 1] * (p[c] - p[c + 1]) + y[c] * (p[c] - p[c - sy]) +
                   y[c + sy] * (p[c] - p[c + sy]) + z[c] * (p[c] - p[c - sz]) + z[c + sz] * (p[c] - p[c + sz]);
      partial[i] += p[c] * product[c];
    }
  });
  return row_sum_.total(grid_.cells[0]);
}

ConjugateGradients::Result ConjugateGradients::solve(const SevenPoint& matrix, bool singular, Field& b, Field& solution,
                                                     double reduction, double target) {
  const Comm& comm = decomposition_.comm();
  double *x = solution.data(), *r = b.data(), *p = direction_.data();
  const double *z = preconditioned_.data(), *q = product_.data();
  solution.fill(0);
  direction_.fill(0);
  preconditioned_.fill(0);
  if (singular) subtract_mean(b);
  double squares = dot(b, b), last = 0;
  target = std::max(target, reduction * reduction * squares);
  Result result;
  while (squares > target && result.iterations < most_iterations) {
    precondition(matrix, b, std::sqrt(squares / cells()));
    const double now = dot(b, preconditioned_), turn = result.iterations == 0 ? 0 : now / last;
    last = now;
    for_rows(grid_, [=](auto c, int n) {
#pragma GCC ivdep
      for (auto i = c; i < c + n; ++i) p[i] = z[i] + turn * p[i];
    });
    const double curvature = comm.sum(multiply(matrix));
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
    squares = comm.sum(row_sum_.total(grid_.cells[0]));
    ++result.iterations;
  }
  if (singular) subtract_mean(solution);
  result.reached = squares <= target;
  return result;
}

}  // namespace bedflow
