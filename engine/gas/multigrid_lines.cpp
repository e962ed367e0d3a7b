// Smoothing of flat or long cells: all cells of a line in a narrow direction at once, lines in red and black.
//
// Their couplings along the line exceed others by the square of the edges' ratio, and whatever stands across it, a bubble's roof
// of three cells, is solved for. So the cells need not be joined along the line, where constant corrections would run through
// such a roof, and no coarse level has to know of it. Long cells, narrow in two directions, have lines in one: upright, as roofs
// are. On levels where joining has made cubes of them a long box has many cells still, and what is wrong with a roof there is
// wrong for as many waves along the box, each an iteration of the conjugate gradients.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "gas/multigrid.h"

namespace bedflow {

namespace {

// The other edges over one edge, from which on lines along that are smoothed as a whole: along an upright one, and along others,
// where there is less to be gained.
constexpr double flat = 2, very_flat = 6;
// Or an upright edge is about the narrowest, and another so many times as long.
constexpr double about = 1.5, elongated = 4;

}  // namespace

// The direction, not before `first`, of lines that lie within this rank's block, on a level of so many cells; -1: none pays.
int Multigrid::line_direction(const Int3& cells, bool whole, int first) const {
  for (int d = first; d < 3; ++d) {
    if (cells[d] == 1 || periodic(d) || !(whole || decomposition_.ranks()[axis_[d]] == 1)) continue;
    double shortest = std::numeric_limits<double>::infinity();  // of the other edges, over this one
    bool thin = false;                                          // one is long, and the box there too
    for (int t = 0; t < 3; ++t) {
      if (t == d || cells[t] == 1) continue;
      const double edge = size(t) / cells[t] * cells[d] / size(d);
      shortest = std::min(shortest, edge);
      thin = thin || (edge >= elongated && size(t) >= size(d));
    }
    if (std::isinf(shortest)) continue;
    const bool upright = axis_[d] == upright_;
    if (shortest >= (upright ? flat : very_flat) || (upright && thin && about * shortest >= 1)) return d;
  }
  return -1;
}

// Lines stand beside each other along the first direction of a level: x, unless they lie along it themselves, or it is much
// narrower than another and its cells are soon joined.
void Multigrid::choose_axes(bool whole) {
  const int lines = line_direction(grid_.global, whole, 0);
  if (lines < 0) return;
  int first = -1;
  for (int d = 0; d < 3; ++d) {
    if (d == lines || grid_.global[d] < widest_register) continue;
    if (first < 0 || size(d) / grid_.global[d] >= flat * size(first) / grid_.global[first]) first = d;
  }
  if (first > 0) std::swap(axis_[0], axis_[first]);
}

// The pivots of each line's matrix, inverted; 0: a cell that touches no other, or hangs on those before it in the line alone.
void Multigrid::factor_lines(Level& level) const {
  constexpr double nothing_left = 1e-9;  // of a diagonal, in double precision
  const int along = level.lines, u = (along + 1) % 3, v = (along + 2) % 3;
  const auto& coupling = level.coupling[along];
  Int3 at{};
  for (at[v] = 0; at[v] < level.cells[v]; ++at[v])
    for (at[u] = 0; at[u] < level.cells[u]; ++at[u]) {
      double before = 0;  // the inverse pivot of the cell before
      for (at[along] = 0; at[along] < level.cells[along]; ++at[along]) {
        const std::ptrdiff_t c = level.index(at[0], at[1], at[2]);
        const double diagonal = static_cast<double>(diagonal_of(level, at));
        const double link = at[along] > 0 ? static_cast<double>(coupling[c]) : 0, pivot = diagonal - link * link * before;
        before = pivot > nothing_left * diagonal ? 1 / pivot : 0;
        level.inverse[c] = static_cast<float>(before);
      }
    }
}

void Multigrid::relax_lines(Level& level, int colour) {
  constexpr float over = 1.1f;
  const int along = level.lines, other = 3 - along, n = level.cells[0];  // lines that stand beside each other along x at once
  const std::ptrdiff_t s = level.stride(along), sy = level.stride(1), sz = level.stride(2);
  const float *cx = level.coupling[0].data(), *cy = level.coupling[1].data(), *cz = level.coupling[2].data();
  const float *link = level.coupling[along].data(), *inverse = level.inverse.data(), *b = level.b.data();
  float* x = level.x.data();
  for (int o = 0; o < level.cells[other]; ++o) {
    const std::ptrdiff_t first = level.index(0, 0, 0) + o * level.stride(other);
    const int odd = (o + level.parity + colour) & 1;
    float* change = row_.data();
    std::fill_n(change, n, 0.0f);
    change += n;
    for (int m = 0; m < level.cells[along]; ++m, change += n) {
      const std::ptrdiff_t from = first + m * s;
#pragma GCC ivdep
      for (int i = 0; i < n; ++i) {
        const std::ptrdiff_t c = from + i;
        const float here = x[c];
        const float lack = b[c] + cx[c] * (x[c - 1] - here) + cx[c + 1] * (x[c + 1] - here) + cy[c] * (x[c - sy] - here) +
                           cy[c + sy] * (x[c + sy] - here) + cz[c] * (x[c - sz] - here) + cz[c + sz] * (x[c + sz] - here);
        change[i] = inverse[c] * (lack + link[c] * change[i - n]);
      }
    }
    std::fill_n(change, n, 0.0f);
    for (int m = level.cells[along] - 1; m >= 0; --m) {
      change -= n;
      const std::ptrdiff_t from = first + m * s;
#pragma GCC ivdep
      for (int i = 0; i < n; ++i) {
        const std::ptrdiff_t c = from + i;
        change[i] += inverse[c] * link[c + s] * change[i + n];
        x[c] += (((i ^ odd) & 1) == 0 ? over : 0) * change[i];
      }
    }
  }
}

}  // namespace bedflow
