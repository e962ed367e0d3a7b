// One cycle over the levels.
#include "gas/multigrid.h"

#include <algorithm>

namespace bedflow {

void Multigrid::apply(const Field& r, double magnitude, Field& z) {
  Level& finest = levels_[0];
  const Int3 n = finest.cells;
  const double down = magnitude > 0 ? 1 / magnitude : 1, up = scale_ / down;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      const double* from = r.data() + grid_.index(0, j, k);
      float* to = finest.b.data() + finest.index(0, j, k);
      for (int i = 0; i < n[0]; ++i) to[i] = static_cast<float>(down * from[i]);
    }
  cycle(0);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      const float* from = finest.x.data() + finest.index(0, j, k);
      double* to = z.data() + grid_.index(0, j, k);
      for (int i = 0; i < n[0]; ++i) to[i] = up * static_cast<double>(from[i]);
    }
}

// x = M⁻¹ b on level l.
void Multigrid::cycle(std::size_t l) {
  Level& level = levels_[l];
  start(level);
  if (l + 1 == levels_.size()) return;  // one cell: solved
  Level& next = levels_[l + 1];
  if (l + 1 == gathered_) {
    gather(level, next);
    cycle(l + 1);
    take_part(next, level);
    return;
  }
  for (int n = 1; n < level.half_sweeps; ++n) relax(level, n % 2);
  restrict_residual(level, next);
  cycle(l + 1);
  prolong(next, level);
  for (int n = level.half_sweeps; n-- > 0;) relax(level, n % 2);
}

// The first half sweep, of red cells, from x = 0.
void Multigrid::start(Level& level) {
  const Int3 n = level.cells;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      const std::ptrdiff_t row = level.index(0, j, k);
      const float *inverse = level.inverse.data() + row, *b = level.b.data() + row;
      float* x = level.x.data() + row;
      const int odd = (j + k + level.parity) & 1;
      for (int i = 0; i < n[0]; ++i) x[i] = ((i ^ odd) & 1) == 0 ? inverse[i] * b[i] : 0;
    }
}

// Cells of one colour towards where their equation holds, by more than all the way. A row is computed as a whole and the other
// colour kept, for which no cell of a row needs what another one there becomes.
void Multigrid::relax(Level& level, int colour) {
  fill_ghosts(level);
  const float *cx = level.coupling[0].data(), *cy = level.coupling[1].data(), *cz = level.coupling[2].data();
  const float *inverse = level.inverse.data(), *b = level.b.data();
  float* x = level.x.data();
  const std::ptrdiff_t sy = level.stride(1), sz = level.stride(2);
  const Int3 n = level.cells;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      const std::ptrdiff_t row = level.index(0, j, k);
      const int odd = (j + k + level.parity + colour) & 1;
#pragma GCC ivdep
      for (int i = 0; i < n[0]; ++i) {
        const std::ptrdiff_t c = row + i;
        const float here = x[c];
        const float lack = b[c] + cx[c] * (x[c - 1] - here) + cx[c + 1] * (x[c + 1] - here) + cy[c] * (x[c - sy] - here) +
                           cy[c + sy] * (x[c + sy] - here) + cz[c] * (x[c - sz] - here) + cz[c + sz] * (x[c + sz] - here);
        x[c] = ((i ^ odd) & 1) == 0 ? here + inverse[c] * lack : here;
      }
    }
}

void Multigrid::restrict_residual(Level& fine, Level& coarse) {
  fill_ghosts(fine);
  const float *cx = fine.coupling[0].data(), *cy = fine.coupling[1].data(), *cz = fine.coupling[2].data();
  const float *b = fine.b.data(), *x = fine.x.data();
  float* row = row_.data();
  const std::ptrdiff_t sy = fine.stride(1), sz = fine.stride(2);
  for (int kc = 0; kc < coarse.cells[2]; ++kc)
    for (int jc = 0; jc < coarse.cells[1]; ++jc) {
      const Int3 low{0, jc * fine.joined[1], kc * fine.joined[2]}, end = fine.end(low);
      std::fill_n(row, fine.cells[0] + 1, 0.0f);
      for (int k = low[2]; k < end[2]; ++k)
        for (int j = low[1]; j < end[1]; ++j) {
          const std::ptrdiff_t from = fine.index(0, j, k);
#pragma GCC ivdep
          for (int i = 0; i < fine.cells[0]; ++i) {
            const std::ptrdiff_t c = from + i;
            row[i] += b[c] + cx[c] * (x[c - 1] - x[c]) + cx[c + 1] * (x[c + 1] - x[c]) + cy[c] * (x[c - sy] - x[c]) +
                      cy[c + sy] * (x[c + sy] - x[c]) + cz[c] * (x[c - sz] - x[c]) + cz[c + sz] * (x[c + sz] - x[c]);
          }
        }
      float* to = coarse.b.data() + coarse.index(0, jc, kc);
      if (fine.joined[0] == 1) {
        std::copy_n(row, coarse.cells[0], to);
      } else {
        for (int i = 0; i < coarse.cells[0]; ++i) to[i] = row[2 * i] + row[2 * i + 1];
      }
    }
}

void Multigrid::prolong(const Level& coarse, Level& fine) {
  float* row = row_.data();
  for (int kc = 0; kc < coarse.cells[2]; ++kc)
    for (int jc = 0; jc < coarse.cells[1]; ++jc) {
      const float* from = coarse.x.data() + coarse.index(0, jc, kc);
      if (fine.joined[0] == 1) {
        std::copy_n(from, coarse.cells[0], row);
      } else {
        for (int i = 0; i < coarse.cells[0]; ++i) row[2 * i] = row[2 * i + 1] = from[i];
      }
      const Int3 low{0, jc * fine.joined[1], kc * fine.joined[2]}, end = fine.end(low);
      for (int k = low[2]; k < end[2]; ++k)
        for (int j = low[1]; j < end[1]; ++j) {
          float* x = fine.x.data() + fine.index(0, j, k);
          for (int i = 0; i < fine.cells[0]; ++i) x[i] += row[i];
        }
    }
}

// ------------------------------------------------------------------------------------------------ between ranks

void Multigrid::fill_ghosts(Level& level) {
  for (int d = 0; d < 3; ++d) {
    const int t1 = (d + 1) % 3, t2 = (d + 2) % 3, n1 = level.cells[t1], n2 = level.cells[t2];
    const std::ptrdiff_t s1 = level.stride(t1), s2 = level.stride(t2);
    const auto layer = [&](int at) {
      Int3 corner{0, 0, 0};
      corner[d] = at;
      return level.x.data() + level.index(corner[0], corner[1], corner[2]);
    };
    for (int side = 0; side < 2; ++side) {  // send towards `side`, receive from the other
      const int to = level.neighbour[d][side], from = level.neighbour[d][1 - side];
      if (to < 0 && from < 0) continue;
      const float* source = layer(side == 0 ? 0 : level.cells[d] - 1);
      float* target = layer(side == 0 ? level.cells[d] : -1);
      send_.clear();
      for (int b = 0; b < n2 && to >= 0; ++b)
        for (int a = 0; a < n1; ++a) send_.push_back(static_cast<double>(source[a * s1 + b * s2]));
      receive_.resize(from >= 0 ? static_cast<std::size_t>(n1) * n2 : 0);
      decomposition_.comm().exchange(to, send_, from, std::span<double>(receive_));
      const double* next = receive_.data();
      for (int b = 0; b < n2 && from >= 0; ++b)
        for (int a = 0; a < n1; ++a) target[a * s1 + b * s2] = static_cast<float>(*next++);
    }
  }
}

void Multigrid::gather(const Level& part, Level& whole) {
  send_.clear();
  for (int k = 0; k < part.cells[2]; ++k)
    for (int j = 0; j < part.cells[1]; ++j)
      for (int i = 0; i < part.cells[0]; ++i) send_.push_back(static_cast<double>(part.b[part.index(i, j, k)]));
  const std::vector<double> all = decomposition_.comm().gather_all(send_);
  for (std::size_t n = 0; n < order_.size(); ++n) whole.b[order_[n]] = static_cast<float>(all[n]);
}

void Multigrid::take_part(const Level& whole, Level& part) {
  const Int3 low = part.first();
  for (int k = 0; k < part.cells[2]; ++k)
    for (int j = 0; j < part.cells[1]; ++j)
      std::copy_n(whole.x.data() + whole.index(low[0], low[1] + j, low[2] + k), part.cells[0],
                  part.x.data() + part.index(0, j, k));
}

}  // namespace bedflow
