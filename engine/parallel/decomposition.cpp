#include "parallel/decomposition.h"

#include <algorithm>
#include <limits>
#include <string>

#include "base/stop.h"

namespace bedflow {

namespace {

// The factors of `ranks` whose cuts have the least area; cuts across `tall` count a hundredfold.
Int3 choose_ranks(int ranks, Int3 cells, Vec3 size, int tall, Int3 narrowest) {
  Int3 best{};
  double least = std::numeric_limits<double>::infinity();
  for (int x = 1; x <= ranks; ++x) {
    if (ranks % x != 0) continue;
    for (int y = 1; y <= ranks / x; ++y) {
      if (ranks / x % y != 0) continue;
      const Int3 trial{x, y, ranks / x / y};
      double area = 0;
      bool fits = true;
      for (int d = 0; d < 3; ++d) {
        fits = fits && cells[d] / trial[d] >= narrowest[d];
        area += (trial[d] - 1) * size[(d + 1) % 3] * size[(d + 2) % 3] * (d == tall ? 100 : 1);
      }
      if (fits && area < least) {
        least = area;
        best = trial;
      }
    }
  }
  if (best[0] == 0) {
    throw Stop(Reason::invalid_case, std::to_string(ranks) + " ranks cannot share a box of " + std::to_string(cells[0]) + " x " +
                                         std::to_string(cells[1]) + " x " + std::to_string(cells[2]) +
                                         " cells: a block would be narrower than the reach of its particles; use fewer ranks");
  }
  return best;
}

}  // namespace

Decomposition::Decomposition(Comm comm, Int3 cells, Vec3 size, std::array<bool, 3> periodic, int tall, Int3 narrowest)
    : comm_(std::move(comm)), global_cells_(cells), size_(size), periodic_(periodic) {
  ranks_ = choose_ranks(comm_.size(), cells, size, tall, narrowest);
  const int rank = comm_.rank();
  place_ = {rank % ranks_[0], rank / ranks_[0] % ranks_[1], rank / (ranks_[0] * ranks_[1])};
  for (int d = 0; d < 3; ++d) {
    first_[d] = first_cell(d, place_[d]);
    const int end = first_cell(d, place_[d] + 1);
    cells_[d] = end - first_[d];
    low_[d] = size[d] * first_[d] / cells[d];
    high_[d] = size[d] * end / cells[d];
    for (int side = 0; side < 2; ++side) {
      Int3 beside = place_;
      beside[d] += side == 0 ? -1 : 1;
      const bool outside = beside[d] < 0 || beside[d] >= ranks_[d];
      beside[d] = (beside[d] + ranks_[d]) % ranks_[d];
      neighbour_[d][side] = outside && !periodic[d] ? -1 : rank_at(beside);
    }
  }
}

int Decomposition::owner(Vec3 point) const {
  Int3 place{};
  for (int d = 0; d < 3; ++d) {
    const int cell = std::clamp(static_cast<int>(point[d] / size_[d] * global_cells_[d]), 0, global_cells_[d] - 1);
    place[d] = cell * ranks_[d] / global_cells_[d];
    while (first_cell(d, place[d]) > cell) --place[d];
    while (first_cell(d, place[d] + 1) <= cell) ++place[d];
  }
  return rank_at(place);
}

}  // namespace bedflow
