#include "particles/cells.h"

#include <algorithm>
#include <cmath>

namespace bedflow {

// The box around the places, cut into as many cells as `edge` allows; a sparse crowd gets wider ones, so that there are never
// many more cells than particles.
void Cells::cover(std::span<const Vec3> places, double edge) {
  Vec3 high = low_ = places.empty() ? Vec3{} : places.front();
  for (const Vec3 x : places)
    for (int d = 0; d < 3; ++d) {
      low_[d] = std::min(low_[d], x[d]);
      high[d] = std::max(high[d], x[d]);
    }
  const Vec3 extent = high - low_;
  std::sort(axis_.begin(), axis_.end(), [&](int a, int b) { return extent[a] != extent[b] ? extent[a] < extent[b] : a < b; });
  const double most = 64 + 4.0 * static_cast<double>(places.size());
  for (;; edge *= 1.25) {
    double cells = 1;
    for (int d = 0; d < 3; ++d) cells *= std::max(1.0, std::floor(extent[axis_[d]] / edge));
    if (cells <= most) break;
  }
  for (int d = 0; d < 3; ++d) {
    const double length = extent[axis_[d]];
    count_[d] = std::max(1, static_cast<int>(length / edge));
    per_edge_[d] = count_[d] > 1 ? count_[d] / length : 1 / std::max(length, edge);
  }
}

std::size_t Cells::cell_of(Vec3 place) const {
  Int3 cell{};
  for (int d = 0; d < 3; ++d)
    cell[d] = std::clamp(static_cast<int>((place[axis_[d]] - low_[axis_[d]]) * per_edge_[d]), 0, count_[d] - 1);
  return row(cell[1], cell[2]) + cell[0];
}

void Cells::sort(std::span<const Vec3> places, double edge, std::uint32_t first_row) {
  cover(places, edge);
  start_.assign(static_cast<std::size_t>(count_[0]) * count_[1] * count_[2] + 1, 0);
  cell_.resize(places.size());
  order_.resize(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    cell_[i] = static_cast<std::uint32_t>(cell_of(places[i]));
    ++start_[cell_[i] + 1];
  }
  for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
  for (std::size_t i = 0; i < places.size(); ++i) order_[start_[cell_[i]]++] = static_cast<std::uint32_t>(i);
  for (std::size_t c = start_.size() - 1; c > 0; --c) start_[c] = start_[c - 1];  // each was moved on to the next one's start
  start_[0] = 0;
  for (std::uint32_t& start : start_) start += first_row;
}

}  // namespace bedflow
