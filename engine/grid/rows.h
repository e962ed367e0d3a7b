// Loops over a part of the grid, a row along x at a time, or several: what is inside one is contiguous, and the compiler
// vectorises it.
#pragma once

#include <algorithm>
#include <vector>

#include "grid/grid.h"

namespace bedflow {

// row(c, n): n entries from index c of a field's data; cells low … high−1.
template <class Row>
void for_rows(const Grid& grid, Int3 low, Int3 high, Row row) {
  const int n = high[0] - low[0];
  if (n <= 0) return;
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; ++j) row(grid.index(low[0], j, k), n);
}

template <class Row>
void for_rows(const Grid& grid, Row row) {
  for_rows(grid, {0, 0, 0}, grid.cells, row);
}

// How many rows of a layer along z are taken as one: short ones leave vector registers half empty, and cost their beginnings.
inline int joined_rows(const Grid& grid) {
  constexpr std::ptrdiff_t most_joined = 256;  // entries: sums over them stay in the nearest cache
  return static_cast<int>(std::max<std::ptrdiff_t>(1, most_joined / grid.stride(1)));
}

// The same, several rows as one. Between the rows lie ghosts and faces of the box, of which row must not ask anything and to
// which it may do anything.
template <class Row>
void for_joined_rows(const Grid& grid, Int3 low, Int3 high, Row row) {
  const int n = high[0] - low[0], together = joined_rows(grid);
  if (n <= 0) return;
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; j += together) {
      const int rows = std::min(together, high[1] - j);
      row(grid.index(low[0], j, k), static_cast<int>(grid.stride(1)) * (rows - 1) + n);
    }
}

template <class Row>
void for_joined_rows(const Grid& grid, Row row) {
  for_joined_rows(grid, {0, 0, 0}, grid.cells, row);
}

// What lies between rows that are taken as one, and as much after the last of each.
template <class Row>
void for_gaps(const Grid& grid, Int3 low, Int3 high, Row row) {
  const int n = high[0] - low[0], gap = static_cast<int>(grid.stride(1)) - n;
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; ++j) row(grid.index(low[0], j, k) + n, gap);
}

// A sum over rows, joined or not, that vectorises without a change of meaning: one partial sum for each place in them.
class RowSum {
 public:
  explicit RowSum(const Grid& grid)
      : stride_(static_cast<std::size_t>(grid.stride(1))), partial_(stride_ * static_cast<std::size_t>(joined_rows(grid))) {}
  double* clear() {
    std::fill(partial_.begin(), partial_.end(), 0.0);
    return partial_.data();
  }
  // Of rows of n entries.
  double total(int n) {
    double* sum = partial_.data();
    for (std::size_t row = stride_; row < partial_.size(); row += stride_)
      for (int i = 0; i < n; ++i) sum[i] += partial_[row + static_cast<std::size_t>(i)];
    double total = 0;
    for (int i = 0; i < n; ++i) total += sum[i];
    return total;
  }
  // The largest of partial results that are maxima.
  double largest(int n) const {
    double result = 0;
    for (std::size_t row = 0; row < partial_.size(); row += stride_)
      for (int i = 0; i < n; ++i) result = std::max(result, partial_[row + static_cast<std::size_t>(i)]);
    return result;
  }

 private:
  std::size_t stride_;
  std::vector<double> partial_;
};

}  // namespace bedflow
