#include "gas/incomplete_cholesky.h"

#include "grid/rows.h"

namespace bedflow {

namespace {

constexpr double modification = 0.97;    // share of the dropped fill-in that the diagonal makes up for
constexpr double smallest_pivot = 0.25;  // of the diagonal; below it the pivot is the diagonal itself

}  // namespace

IncompleteCholesky::IncompleteCholesky(const Grid& grid)
    : grid_(grid), pivot_(grid), row_(static_cast<std::size_t>(grid.cells[0])), carry_(static_cast<std::size_t>(grid.cells[0])) {}

// e_c = A_cc − Σ_t c_t² E_t − modification · Σ_t c_t E_t (the other couplings upward of cell t), t: the cell before c in x, y, z.
void IncompleteCholesky::factor(const SevenPoint& matrix) {
  const double *x = matrix.coupling[0].data(), *y = matrix.coupling[1].data(), *z = matrix.coupling[2].data();
  double* pivot = pivot_.data();
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2);
  const int nx = grid_.cells[0], ny = grid_.cells[1], nz = grid_.cells[2];
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) {
      const double up_y = j + 1 < ny ? 1 : 0, up_z = k + 1 < nz ? 1 : 0;  // 0: that cell is another block's
      std::ptrdiff_t c = grid_.index(0, j, k);
      for (int i = 0; i < nx; ++i, ++c) {
        const double up_x = i + 1 < nx ? 1 : 0;
        const double diagonal = x[c] + x[c + 1] + y[c] + y[c + sy] + z[c] + z[c + sz];
        const double west = x[c] * pivot[c - 1], south = y[c] * pivot[c - sy], below = z[c] * pivot[c - sz];
        const double kept = diagonal - west * x[c] - south * y[c] - below * z[c];
        const double dropped = west * (up_y * y[c - 1 + sy] + up_z * z[c - 1 + sz]) +
                               south * (up_x * x[c - sy + 1] + up_z * z[c - sy + sz]) +
                               below * (up_x * x[c - sz + 1] + up_y * y[c - sz + sy]);
        double e = kept - modification * dropped;
        if (!(e > smallest_pivot * diagonal)) e = diagonal;
        pivot[c] = e > 0 ? 1 / e : 0;  // 0: a cell that touches no other
      }
    }
}

void IncompleteCholesky::apply(const SevenPoint& matrix, const Field& r, Field& z) {
  const double *cx = matrix.coupling[0].data(), *cy = matrix.coupling[1].data(), *cz = matrix.coupling[2].data();
  const double *pivot = pivot_.data(), *right = r.data();
  double *out = z.data(), *row = row_.data(), *carry = carry_.data();
  const std::ptrdiff_t sy = grid_.stride(1), sz = grid_.stride(2);
  for_rows(grid_, [=](auto c, int n) {
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) {
      row[i] = pivot[c + i] * (right[c + i] + cy[c + i] * out[c + i - sy] + cz[c + i] * out[c + i - sz]);
      carry[i] = pivot[c + i] * cx[c + i];
    }
    double last = 0;
    for (int i = 0; i < n; ++i) out[c + i] = last = row[i] + carry[i] * last;
  });
  for (int k = grid_.cells[2] - 1; k >= 0; --k)
    for (int j = grid_.cells[1] - 1; j >= 0; --j) {
      const std::ptrdiff_t c = grid_.index(0, j, k);
      const int n = grid_.cells[0];
#pragma GCC ivdep
      for (int i = 0; i < n; ++i) {
        const std::ptrdiff_t at = c + i;
        row[i] = out[at] + pivot[at] * (cy[at + sy] * out[at + sy] + cz[at + sz] * out[at + sz]);
        carry[i] = pivot[at] * cx[at + 1];
      }
      double last = 0;
      for (int i = n - 1; i >= 0; --i) out[c + i] = last = row[i] + carry[i] * last;
    }
}

}  // namespace bedflow
