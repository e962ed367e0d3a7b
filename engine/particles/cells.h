// Cells that sort particles in space and find their neighbours.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "parallel/decomposition.h"

namespace bedflow {

class Cells {
 public:
  // Covers the places with cells no narrower than `edge` (m), at most a few a particle; the longest direction runs slowest.
  // Afterwards order()[new] = old, stable within a cell. The places are those of the rows from first_row on, before and after.
  void sort(std::span<const Vec3> places, double edge, std::uint32_t first_row = 0);
  const std::vector<std::uint32_t>& order() const { return order_; }
  std::uint32_t first() const { return start_.front(); }
  std::uint32_t last() const { return start_.back(); }

  // Of sorted particles: visits the runs [first, last) of rows that stand in the cells within `reach` (m) of a point anywhere.
  template <class Visit>
  void around(Vec3 point, double reach, Visit visit) const {
    Int3 low{}, high{};
    for (int d = 0; d < 3; ++d) {
      const double middle = point[axis_[d]] - low_[axis_[d]];
      const double from = (middle - reach) * per_edge_[d], to = (middle + reach) * per_edge_[d];
      if (!(to >= 0 && from < count_[d])) return;  // too far from all
      low[d] = from > 0 ? static_cast<int>(from) : 0;
      high[d] = to < count_[d] ? static_cast<int>(to) : count_[d] - 1;
    }
    for (int slow = low[2]; slow <= high[2]; ++slow)
      for (int j = low[1]; j <= high[1]; ++j) visit(start_[row(j, slow) + low[0]], start_[row(j, slow) + high[0] + 1]);
  }

  // Of sorted particles: visits (particle, first, last) with the runs of rows behind it in its own and the cells around it, so
  // that each pair of neighbours is met once.
  template <class Visit>
  void behind(Visit visit) const {
    for (int slow = 0; slow < count_[2]; ++slow)
      for (int j = 0; j < count_[1]; ++j)
        for (int i = 0; i < count_[0]; ++i) {
          const std::size_t cell = row(j, slow) + i;
          if (start_[cell] == start_[cell + 1]) continue;
          const int from = i > 0 ? -1 : 0, to = i + 1 < count_[0] ? 2 : 1;
          struct Run {
            std::uint32_t first, last;
          } runs[4];
          int n = 0;
          const auto look = [&](int dj, int dslow) {
            if (j + dj < 0 || j + dj >= count_[1] || slow + dslow >= count_[2]) return;
            const std::size_t beside = row(j + dj, slow + dslow) + i;
            runs[n++] = {start_[beside + from], start_[beside + to]};
          };
          look(1, 0);
          for (int dj = -1; dj <= 1; ++dj) look(dj, 1);
          for (std::uint32_t p = start_[cell]; p < start_[cell + 1]; ++p) {
            visit(p, p + 1, start_[cell + to]);
            for (int r = 0; r < n; ++r) visit(p, runs[r].first, runs[r].last);
          }
        }
  }

 private:
  void cover(std::span<const Vec3> places, double edge);
  std::size_t row(int j, int slow) const {
    return static_cast<std::size_t>(count_[0]) * (j + static_cast<std::size_t>(count_[1]) * slow);
  }
  std::size_t cell_of(Vec3 place) const;

  Int3 axis_{0, 1, 2};  // directions, fastest first; count_ and per_edge_ are in this order
  Int3 count_{1, 1, 1};
  Vec3 low_, per_edge_;
  std::vector<std::uint32_t> start_, cell_, order_;
};

}  // namespace bedflow
