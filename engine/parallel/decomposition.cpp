#include "parallel/decomposition.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "base/check.h"
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

Cuts even_cuts(int ranks, Int3 cells, Vec3 size, int tall, Int3 narrowest) {
  const Int3 blocks = choose_ranks(ranks, cells, size, tall, narrowest);
  Cuts cuts;
  for (int d = 0; d < 3; ++d)
    for (int place = 0; place <= blocks[d]; ++place)
      cuts[d].push_back(static_cast<int>(static_cast<long>(cells[d]) * place / blocks[d]));
  return cuts;
}

// By the best of each number of cells for one part fewer (dynamic programming).
std::vector<int> cheapest_cuts(const std::vector<double>& cost, int parts, int narrowest) {
  const int cells = static_cast<int>(cost.size());
  CHECK(parts >= 1 && narrowest >= 1 && parts * narrowest <= cells, parts, narrowest, cells);
  std::vector<double> below{0};
  for (const double c : cost) below.push_back(below.back() + c);
  constexpr double never = std::numeric_limits<double>::infinity();
  std::vector<double> dearest(cells + 1, never), fewer;  // of the first so many cells in the parts so far
  dearest[0] = 0;
  std::vector<std::vector<int>> last(parts, std::vector<int>(cells + 1));  // where the last of these parts begins
  for (int part = 0; part < parts; ++part) {
    fewer.assign(cells + 1, never);
    fewer.swap(dearest);
    for (int end = narrowest; end <= cells; ++end)
      for (int begin = end - narrowest; begin >= 0 && below[end] - below[begin] <= dearest[end]; --begin) {
        const double dear = std::max(fewer[begin], below[end] - below[begin]);
        if (dear <= dearest[end]) dearest[end] = dear, last[part][end] = begin;
      }
  }
  std::vector<int> cuts(parts + 1, cells);
  for (int part = parts - 1; part >= 0; --part) cuts[part] = last[part][cuts[part + 1]];
  return cuts;
}

Decomposition::Decomposition(Comm comm, Vec3 size, std::array<bool, 3> periodic, Cuts cuts)
    : comm_(std::move(comm)), cuts_(std::move(cuts)), size_(size), periodic_(periodic) {
  for (int d = 0; d < 3; ++d) {
    ranks_[d] = static_cast<int>(cuts_[d].size()) - 1;
    global_cells_[d] = cuts_[d].back();
  }
  CHECK(ranks_[0] * ranks_[1] * ranks_[2] == comm_.size(), ranks_[0], ranks_[1], ranks_[2], comm_.size());
  const int rank = comm_.rank();
  place_ = {rank % ranks_[0], rank / ranks_[0] % ranks_[1], rank / (ranks_[0] * ranks_[1])};
  for (int d = 0; d < 3; ++d) {
    first_[d] = cuts_[d][place_[d]];
    const int end = cuts_[d][place_[d] + 1];
    cells_[d] = end - first_[d];
    low_[d] = size[d] * first_[d] / global_cells_[d];
    high_[d] = size[d] * end / global_cells_[d];
    for (int side = 0; side < 2; ++side) {
      Int3 beside = place_;
      beside[d] += side == 0 ? -1 : 1;
      const bool outside = beside[d] < 0 || beside[d] >= ranks_[d];
      beside[d] = (beside[d] + ranks_[d]) % ranks_[d];
      neighbour_[d][side] = outside && !periodic[d] ? -1 : rank_at(beside);
    }
  }
}

int Decomposition::cell_of(int d, double x) const {
  return std::clamp(static_cast<int>(x / size_[d] * global_cells_[d]), 0, global_cells_[d] - 1);
}

int Decomposition::owner(Vec3 point) const {
  Int3 place{};
  for (int d = 0; d < 3; ++d) {
    const auto after = std::upper_bound(cuts_[d].begin(), cuts_[d].end(), cell_of(d, point[d]));
    place[d] = static_cast<int>(after - cuts_[d].begin()) - 1;
  }
  return rank_at(place);
}

}  // namespace bedflow
