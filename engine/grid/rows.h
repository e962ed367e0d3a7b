// Loops over a part of the grid, a row along x at a time: what is inside one is contiguous, and the compiler vectorises it.
#pragma once

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

// A sum over rows that vectorises without a change of meaning: one partial sum for each place in the row.
class RowSum {
 public:
  explicit RowSum(int longest_row) : partial_(static_cast<std::size_t>(longest_row)) {}
  double* clear() {
    std::fill(partial_.begin(), partial_.end(), 0.0);
    return partial_.data();
  }
  double total() const {
    double sum = 0;
    for (double value : partial_) sum += value;
    return sum;
  }

 private:
  std::vector<double> partial_;
};

}  // namespace bedflow
