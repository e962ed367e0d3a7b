// One cycle over the levels.
#include "gas/multigrid.h"

#include <algorithm>

namespace bedflow {

namespace {

constexpr int stretch = 1024;  // of a layer, swept at once: new values and what they are made of stay in the nearest cache

}  // namespace

void Multigrid::apply(const Field& r, double magnitude, Field& z) {
  Level& finest = levels_[0];
  const double down = magnitude > 0 ? 1 / magnitude : 1, up = scale_ / down;
  for_finest(finest.cells, [&](std::ptrdiff_t at, std::ptrdiff_t step, std::ptrdiff_t here, int n) {
    const double* from = r.data() + at;
    float* to = finest.b.data() + here;
    for (int i = 0; i < n; ++i) to[i] = static_cast<float>(down * from[i * step]);
  });
  cycle(0);
  for_finest(finest.cells, [&](std::ptrdiff_t at, std::ptrdiff_t step, std::ptrdiff_t here, int n) {
    const float* from = finest.x.data() + here;
    double* to = z.data() + at;
    for (int i = 0; i < n; ++i) to[i * step] = up * static_cast<double>(from[i]);
  });
}

// x = M⁻¹ b on level l.
void Multigrid::cycle(std::size_t l) {
  Level& level = levels_[l];
  if (l + 1 == levels_.size()) return solve_coarsest();
  start(level);
  Level& next = levels_[l + 1];
  if (l + 1 == gathered_) {
    gather(level, next);
    cycle(l + 1);
    take_part(next, level);
    return;
  }
  const auto relax_anew = [&](int colour) {  // which hangs on the other colour alone
    fill_ghosts(level, 1 - colour);
    relax(level, colour);
  };
  for (int n = 1; n < level.half_sweeps; ++n) relax_anew(n % 2);
  fill_ghosts(level, (level.half_sweeps - 1) % 2);  // the other colour's are right since the last half sweep
  restrict_residual(level, next);
  cycle(l + 1);
  prolong(next, level);
  for (int n = level.half_sweeps; n-- > 0;) relax_anew(n % 2);
}

void Multigrid::solve_coarsest() {
  Level& level = levels_.back();
  const std::size_t n = coarsest_.size();
  std::fill(solution_.begin(), solution_.end(), 0.0f);
  float* x = solution_.data();
  for (std::size_t m = 0; m < n; ++m) {
    const float b = level.b[coarsest_[m]], *row = inverse_.data() + m * n;
    for (std::size_t i = 0; i < n; ++i) x[i] += b * row[i];
  }
  for (std::size_t m = 0; m < n; ++m) level.x[coarsest_[m]] = x[m];
}

// The first half sweep, of red cells, from x = 0.
void Multigrid::start(Level& level) {
  if (level.lines >= 0) {
    std::fill(level.x.begin(), level.x.end(), 0.0f);
    return relax_lines(level, 0);
  }
  const auto n = static_cast<int>(level.layer());
  for (int k = 0; k < level.cells[2]; ++k) {
    const std::ptrdiff_t from = level.index(0, 0, k);
    const float *inverse = level.inverse.data() + from, *b = level.b.data() + from;
    float* x = level.x.data() + from;
    const int odd = (k + level.parity) & 1;
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) x[i] = ((i ^ odd) & 1) == 0 ? inverse[i] * b[i] : 0;
  }
}

// Cells of one colour towards where their equation holds, by more than all the way. A stretch of a layer is computed as a whole
// and the other colour kept; no cell needs what another one of its colour becomes, so the new values may wait in a row of their
// own (reading what has just been written would hold the processor up).
void Multigrid::relax(Level& level, int colour) {
  if (level.lines >= 0) return relax_lines(level, colour);
  const std::ptrdiff_t sy = level.stride(1), sz = level.stride(2);
  const auto layer = static_cast<int>(level.layer());
  float* next = row_.data();
  for (int k = 0; k < level.cells[2]; ++k)
    for (int start = 0; start < layer; start += stretch) {
      const int n = std::min(stretch, layer - start), odd = (k + level.parity + colour + start) & 1;
      const std::ptrdiff_t from = level.index(0, 0, k) + start;
      const float *cx = level.coupling[0].data() + from, *cy = level.coupling[1].data() + from,
                  *cz = level.coupling[2].data() + from;
      const float *inverse = level.inverse.data() + from, *b = level.b.data() + from;
      float* x = level.x.data() + from;
#pragma GCC ivdep
      for (int i = 0; i < n; ++i) {
        const float here = x[i];
        const float lack = b[i] + cx[i] * (x[i - 1] - here) + cx[i + 1] * (x[i + 1] - here) + cy[i] * (x[i - sy] - here) +
                           cy[i + sy] * (x[i + sy] - here) + cz[i] * (x[i - sz] - here) + cz[i + sz] * (x[i + sz] - here);
        next[i] = here + (((i ^ odd) & 1) == 0 ? inverse[i] : 0) * lack;
      }
      std::copy_n(next, n, x);
    }
}

void Multigrid::restrict_residual(Level& fine, Level& coarse) {
  const std::ptrdiff_t sy = fine.stride(1), sz = fine.stride(2);
  const auto n = static_cast<int>(fine.layer());
  float* sum = row_.data();
  for (int kc = 0; kc < coarse.cells[2]; ++kc) {
    const int low = kc * fine.joined[2], end = fine.end({0, 0, low})[2];
    std::fill_n(sum, n + 1, 0.0f);
    for (int k = low; k < end; ++k) {
      const std::ptrdiff_t from = fine.index(0, 0, k);
      const float *cx = fine.coupling[0].data() + from, *cy = fine.coupling[1].data() + from,
                  *cz = fine.coupling[2].data() + from;
      const float *b = fine.b.data() + from, *x = fine.x.data() + from;
#pragma GCC ivdep
      for (int i = 0; i < n; ++i)
        sum[i] += b[i] + cx[i] * (x[i - 1] - x[i]) + cx[i + 1] * (x[i + 1] - x[i]) + cy[i] * (x[i - sy] - x[i]) +
                  cy[i + sy] * (x[i + sy] - x[i]) + cz[i] * (x[i - sz] - x[i]) + cz[i + sz] * (x[i + sz] - x[i]);
    }
    for (int jc = 0; jc < coarse.cells[1]; ++jc) {
      const int first = jc * fine.joined[1];
      float* row = sum + first * sy;
      if (fine.end({0, first, 0})[1] > first + 1) {
        for (int i = 0; i < fine.cells[0]; ++i) row[i] += row[i + sy];
      }
      row[fine.cells[0]] = 0;  // beyond an odd number of cells
      float* to = coarse.b.data() + coarse.index(0, jc, kc);
      if (fine.joined[0] == 1) {
        std::copy_n(row, coarse.cells[0], to);
      } else {
        for (int i = 0; i < coarse.cells[0]; ++i) to[i] = row[2 * i] + row[2 * i + 1];
      }
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

// Of x, in cells of a colour; in all where lines are smoothed, or an odd number of cells closes on itself, so that two of one
// colour meet.
void Multigrid::fill_ghosts(Level& level, int colour) {
  for (int d = 0; d < 3; ++d) {
    const std::array<int, 2>& neighbours = level.neighbour[d];
    if (neighbours[0] < 0 && neighbours[1] < 0) continue;
    const int t1 = (d + 1) % 3, t2 = (d + 2) % 3, n1 = level.cells[t1], n2 = level.cells[t2];
    const std::ptrdiff_t s1 = level.stride(t1), s2 = level.stride(t2);
    const bool all = level.lines >= 0 || (periodic(d) && level.global[d] % 2 == 1);
    const int step = all ? 1 : 2;
    const auto length =
        static_cast<std::size_t>((n1 * n2 + step - 1) / step);  // of a message; of one colour there may be one less
    // Act(cell that passes, its number), for layer `at`, of this block or the one beside.
    const auto for_layer = [&](int at, auto act) {
      Int3 corner{0, 0, 0};
      corner[d] = at;
      float* layer = level.x.data() + level.index(corner[0], corner[1], corner[2]);
      std::size_t m = 0;
      for (int b = 0; b < n2; ++b)
        for (int a = all ? 0 : (at + b + level.parity + colour) & 1; a < n1; a += step) act(layer[a * s1 + b * s2], m++);
    };
    const std::array<int, 2> ghosts = {-1, level.cells[d]}, owners = {0, level.cells[d] - 1};
    for (int side = 0; side < 2; ++side) {
      if (neighbours[side] < 0) continue;
      send_[side].resize(length);
      receive_[side].resize(length);
      for_layer(owners[side], [out = send_[side].data()](float here, std::size_t m) { out[m] = here; });
    }
    decomposition_.comm().exchange(neighbours, send_, receive_);
    for (int side = 0; side < 2; ++side) {
      if (neighbours[side] < 0) continue;
      for_layer(ghosts[side], [in = receive_[side].data()](float& here, std::size_t m) { here = in[m]; });
    }
  }
}

void Multigrid::gather(const Level& part, Level& whole) {
  part_.clear();
  for (int k = 0; k < part.cells[2]; ++k)
    for (int j = 0; j < part.cells[1]; ++j)
      for (int i = 0; i < part.cells[0]; ++i) part_.push_back(static_cast<double>(part.b[part.index(i, j, k)]));
  const std::vector<double> all = decomposition_.comm().gather_all(part_);
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
