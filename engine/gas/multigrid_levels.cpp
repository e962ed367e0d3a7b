// The levels of the multigrid: which cells are joined, and the coefficients of what comes of it.
#include <algorithm>
#include <cmath>
#include <limits>

#include "gas/multigrid.h"

namespace bedflow {

namespace {

constexpr std::int64_t most_gathered =
    4096;                                  // cells: to solve them on every rank costs no more than the messages otherwise would
constexpr std::int64_t most_solved = 100;  // cells of which the inverse matrix is taken: smoothing them costs more,
constexpr std::int64_t inversion_per_cell =
    70;                            // as long as the inversion takes at most so many operations a cell of the finest grid
constexpr double longest = 1.5;    // edge over the narrowest one at which cells are still joined in its direction
constexpr double half_sweeps = 3;  // on the finest level
constexpr double growth = 0.5;     // half sweeps grow with this power of the ratio of cells, and
constexpr double most_half_sweeps = 16;
constexpr double relaxation = 1.15;  // Yavneh 1996: about the best in three dimensions

constexpr float barrier = 0.35f;  // of what distances alone would couple: the least that is left over a barrier in flat cells

// From the middle of a pair of cells to that of the next, by the couplings in the one, between them, and in the other.
float in_series(float before, float between, float after) {
  if (!(before > 0 && between > 0 && after > 0)) return 0;
  return 1 / (0.5f / before + 1 / between + 0.5f / after);
}

std::vector<float> joined_by_twos(const std::vector<float>& edges) {
  std::vector<float> result;
  for (std::size_t i = 0; i < edges.size(); i += 2) result.push_back(edges[i] + (i + 1 < edges.size() ? edges[i + 1] : 0));
  return result;
}

std::vector<float> chained(const std::vector<std::vector<float>>& blocks) {
  std::vector<float> result;
  for (const auto& block : blocks) result.insert(result.end(), block.begin(), block.end());
  return result;
}

}  // namespace

Int3 Multigrid::Level::first() const {
  Int3 result{};
  for (int d = 0; d < 3; ++d)
    for (int p = 0; p < place[d]; ++p) result[d] += static_cast<int>(edges[d][p].size());
  return result;
}

float Multigrid::Level::edge(int d, int i) const {
  const int blocks = static_cast<int>(edges[d].size());
  if (i >= 0 && i < cells[d]) return edges[d][place[d]][i];
  const int side = i < 0 ? 0 : 1;
  if (neighbour[d][side] < 0) return 0;
  const auto& beside = edges[d][(place[d] + (side == 0 ? blocks - 1 : 1)) % blocks];
  return side == 0 ? beside.back() : beside.front();
}

Int3 Multigrid::Level::end(Int3 low) const {
  Int3 result;
  for (int d = 0; d < 3; ++d) result[d] = std::min(low[d] + joined[d], cells[d]);
  return result;
}

Multigrid::Multigrid(const Decomposition& decomposition, const Grid& grid, int upright)
    : decomposition_(decomposition), grid_(grid), upright_(upright) {
  bool whole = decomposition.comm().size() == 1;
  choose_axes(whole);
  std::array<Edges, 3> edges;
  Int3 place;
  for (int d = 0; d < 3; ++d) {
    for (int p = 0; p < decomposition.ranks()[axis_[d]]; ++p)
      edges[d].emplace_back(static_cast<std::size_t>(decomposition.cells(axis_[d], p)), 1.0f);
    place[d] = decomposition.place()[axis_[d]];
  }
  for (;;) {
    add_level(edges, place, whole);
    Level& level = levels_.back();
    const std::int64_t cells = static_cast<std::int64_t>(level.global[0]) * level.global[1] * level.global[2];
    if (whole && cells <= most_solved &&
        cells * cells * cells <= inversion_per_cell * grid_.global[0] * grid_.global[1] * grid_.global[2])
      break;
    const bool stuck = !choose_joined(level, whole);
    if (!whole && (stuck || cells <= most_gathered)) {
      for (Edges& e : edges) e = {chained(e)};
      level.joined = {1, 1, 1};
      place = {0, 0, 0};
      whole = true;
      gathered_ = levels_.size();
      continue;
    }
    for (int d = 0; d < 3; ++d)
      if (level.joined[d] == 2)
        for (auto& block : edges[d]) block = joined_by_twos(block);
  }
  for (std::size_t l = 1; l < levels_.size(); ++l) measure(levels_[l - 1], levels_[l]);
  if (gathered_ > 0) set_order();
  std::ptrdiff_t longest_row = 0;
  for (const Level& level : levels_) longest_row = std::max({longest_row, level.layer() + 1, level.stride(1), level.section()});
  row_.resize(static_cast<std::size_t>(longest_row));
  const Level& last = levels_.back();
  for (int k = 0; k < last.cells[2]; ++k)
    for (int j = 0; j < last.cells[1]; ++j)
      for (int i = 0; i < last.cells[0]; ++i) coarsest_.push_back(last.index(i, j, k));
  solution_.resize(coarsest_.size());
  inverse_.resize(coarsest_.size() * coarsest_.size());
  matrix_.resize(inverse_.size());
  diagonal_.resize(coarsest_.size());
  pivot_row_.resize(coarsest_.size());
}

void Multigrid::add_level(const std::array<Edges, 3>& edges, Int3 place, bool whole) {
  Level& level = levels_.emplace_back();
  level.edges = edges;
  level.place = place;
  double finer = 1;  // finest cells in one of these
  for (int d = 0; d < 3; ++d) {
    level.cells[d] = static_cast<int>(edges[d][place[d]].size());
    level.global[d] = static_cast<int>(chained(edges[d]).size());
    for (int side = 0; side < 2; ++side) {
      level.neighbour[d][side] = !whole        ? decomposition_.neighbour(axis_[d], side)
                                 : periodic(d) ? decomposition_.comm().rank()
                                               : -1;
    }
    finer *= static_cast<double>(grid_.global[axis_[d]]) / level.global[d];
  }
  const Int3 first = level.first();
  level.parity = (first[0] + first[1] + first[2]) & 1;
  level.half_sweeps = static_cast<int>(std::lround(half_sweeps * std::min(most_half_sweeps, std::pow(finer, growth))));
  const auto size = static_cast<std::size_t>(level.stride(2)) * static_cast<std::size_t>(level.cells[2] + 2);
  for (auto* field : {&level.coupling[0], &level.coupling[1], &level.coupling[2], &level.inverse, &level.x, &level.b})
    field->assign(size, 0);
}

// False: a block is down to one cell in a direction in which cells should be joined.
bool Multigrid::choose_joined(Level& level, bool whole) const {
  level.lines = grid_.global[axis_[0]] < widest_register ? -1 : line_direction(level.global, whole, 1);
  double narrowest = std::numeric_limits<double>::infinity();
  Vec3 edge;
  for (int d = 0; d < 3; ++d) {
    edge[d] = size(d) / level.global[d];
    if (level.global[d] > 1 && d != level.lines) narrowest = std::min(narrowest, edge[d]);
  }
  bool possible = true;
  for (int d = 0; d < 3; ++d) {
    if (level.global[d] == 1 || d == level.lines || edge[d] >= longest * narrowest) continue;
    level.joined[d] = 2;
    for (const auto& block : level.edges[d]) possible = possible && (block.size() > 1 || level.edges[d].size() == 1);
  }
  return possible;
}

std::size_t Multigrid::bytes() const {
  std::size_t sum = 0;
  for (const Level& level : levels_) sum += 6 * sizeof(float) * level.x.size();
  return sum;
}

void Multigrid::factor(const SevenPoint& matrix) {
  Level& finest = levels_[0];
  double largest = 0;
  for (const Field& coupling : matrix.coupling.component)
    for (std::size_t i = 0; i < coupling.size(); ++i) largest = std::max(largest, coupling.data()[i]);
  largest = decomposition_.comm().max(largest);
  scale_ = largest > 0 ? 1 / largest : 1;
  for (int d = 0; d < 3; ++d) {
    const double scale = finest.global[d] == 1 && periodic(d) ? 0 : scale_;  // a cell beside itself
    Int3 high = finest.cells;
    ++high[d];
    for_finest(high, [&](std::ptrdiff_t at, std::ptrdiff_t step, std::ptrdiff_t here, int n) {
      const double* from = matrix.coupling[axis_[d]].data() + at;
      float* to = finest.coupling[d].data() + here;
      for (int i = 0; i < n; ++i) to[i] = static_cast<float>(scale * from[i * step]);
    });
  }
  for (std::size_t l = 1; l < levels_.size(); ++l) {
    invert(levels_[l - 1]);
    if (l == gathered_)
      gather_couplings(levels_[l - 1], levels_[l]);
    else
      coarsen(levels_[l - 1], levels_[l]);
  }
  invert_coarsest();
}

void Multigrid::measure(const Level& fine, Level& coarse) const {
  for (int d = 0; d < 3; ++d)
    for (int face = 0; face <= coarse.cells[d]; ++face) {
      const int low = std::min(fine.joined[d] * face, fine.cells[d]);
      const float near = fine.edge(d, low - 1) + fine.edge(d, low), far = coarse.edge(d, face - 1) + coarse.edge(d, face);
      coarse.nearer[d].push_back(near / far);
    }
}

void Multigrid::coarsen(const Level& fine, Level& coarse) const {
  for (int d = 0; d < 3; ++d) {
    if (coarse.global[d] == 1 && periodic(d)) continue;  // a cell beside itself
    const int t1 = (d + 1) % 3, t2 = (d + 2) % 3;
    const bool alone = fine.lines < 0 && fine.joined[d] == 2 && fine.joined[t1] == 1 && fine.joined[t2] == 1;
    Int3 high = coarse.cells, at{};
    ++high[d];
    for (at[2] = 0; at[2] < high[2]; ++at[2])
      for (at[1] = 0; at[1] < high[1]; ++at[1])
        for (at[0] = 0; at[0] < high[0]; ++at[0]) {
          Int3 low;
          for (int t = 0; t < 3; ++t) low[t] = std::min(fine.joined[t] * at[t], fine.cells[t]);
          const Int3 end = fine.end(low);
          const float nearer = coarse.nearer[d][static_cast<std::size_t>(at[d])];
          const bool series = alone && low[d] >= 2 && low[d] + 1 < fine.cells[d];  // else a half is another rank's, or none
          float sum = 0;
          Int3 from = low;
          for (from[t2] = low[t2]; from[t2] < end[t2]; ++from[t2])
            for (from[t1] = low[t1]; from[t1] < end[t1]; ++from[t1]) {
              const float* face = fine.coupling[d].data() + fine.index(from[0], from[1], from[2]);
              const float even = *face * nearer;
              sum +=
                  series ? std::clamp(in_series(face[-fine.stride(d)], *face, face[fine.stride(d)]), barrier * even, even) : even;
            }
          coarse.coupling[d][coarse.index(at[0], at[1], at[2])] = sum;
        }
  }
}

// Of a cell's equation: the sum of its couplings. Where an odd number of cells closes on itself, two of one colour meet: what
// they hold each other by counts twice, so that the half sweep, which does not see that both move, cannot overshoot.
float Multigrid::diagonal_of(const Level& level, Int3 at) const {
  const std::ptrdiff_t c = level.index(at[0], at[1], at[2]);
  const Int3 first = level.first();
  float sum = 0;
  for (int d = 0; d < 3; ++d) {
    const float low = level.coupling[d][c], high = level.coupling[d][c + level.stride(d)];
    const bool closes = periodic(d) && level.global[d] % 2 == 1;
    const int cell = first[d] + at[d];
    sum += (closes && cell == 0 ? 2 : 1) * low + (closes && cell == level.global[d] - 1 ? 2 : 1) * high;
  }
  return sum;
}

void Multigrid::invert(Level& level) const {
  if (level.lines >= 0) return factor_lines(level);
  Int3 at{};
  for (at[2] = 0; at[2] < level.cells[2]; ++at[2])
    for (at[1] = 0; at[1] < level.cells[1]; ++at[1])
      for (at[0] = 0; at[0] < level.cells[0]; ++at[0]) {
        const float sum = diagonal_of(level, at);
        level.inverse[level.index(at[0], at[1], at[2])] = sum > 0 ? static_cast<float>(relaxation) / sum : 0;
      }
}

// By elimination, which needs no other order in a matrix like this. A cell that hangs on those before it alone, as where x is
// given nowhere, has nothing left on its diagonal: x is 0 there.
void Multigrid::invert_coarsest() {
  const Level& level = levels_.back();
  const std::size_t n = coarsest_.size();
  std::fill(matrix_.begin(), matrix_.end(), 0.0);
  for (std::size_t m = 0; m < n; ++m) {
    double* row = matrix_.data() + m * n;
    std::size_t stride = 1;
    for (int d = 0; d < 3; ++d) {
      const auto count = static_cast<std::size_t>(level.cells[d]), at = m / stride % count;
      for (const std::size_t side : {0, 1}) {
        const auto face = coarsest_[m] + static_cast<std::ptrdiff_t>(side) * level.stride(d);
        const double coupling = static_cast<double>(level.coupling[d][face]);
        const bool last = at == (side == 0 ? 0 : count - 1);
        row[m] += coupling;
        if (last && periodic(d)) row[side == 0 ? m + (count - 1) * stride : m - (count - 1) * stride] -= coupling;
        if (!last) row[side == 0 ? m - stride : m + stride] -= coupling;
      }
      stride *= count;
    }
  }
  for (std::size_t m = 0; m < n; ++m) diagonal_[m] = matrix_[m * n + m];
  for (std::size_t m = 0; m < n; ++m) {
    double* row = matrix_.data() + m * n;
    const double inverse = row[m] > 1e-12 * diagonal_[m] ? 1 / row[m] : 0;  // round-off of some hundred operations
    for (std::size_t i = 0; i < n; ++i) pivot_row_[i] = inverse * row[i];
    for (std::size_t i = 0; i < n; ++i) {
      if (i == m) continue;
      double* other = matrix_.data() + i * n;
      const double factor = other[m];
      for (std::size_t j = 0; j < n; ++j) other[j] -= factor * pivot_row_[j];
      other[m] = -factor * inverse;
    }
    std::copy(pivot_row_.begin(), pivot_row_.end(), row);
    row[m] = inverse;
  }
  for (std::size_t m = 0; m < n; ++m)
    for (std::size_t i = 0; i < n; ++i) inverse_[m * n + i] = static_cast<float>(matrix_[std::max(m, i) * n + std::min(m, i)]);
}

// Both faces a cell and direction, for the last face of the box is no cell's lower one.
void Multigrid::gather_couplings(const Level& from, Level& to) {
  part_.clear();
  for (int k = 0; k < from.cells[2]; ++k)
    for (int j = 0; j < from.cells[1]; ++j)
      for (int i = 0; i < from.cells[0]; ++i)
        for (int d = 0; d < 3; ++d)
          for (int side = 0; side < 2; ++side)
            part_.push_back(static_cast<double>(from.coupling[d][from.index(i, j, k) + side * from.stride(d)]));
  const std::vector<double> all = decomposition_.comm().gather_all(part_);
  const double* next = all.data();
  for (const std::ptrdiff_t c : order_)
    for (int d = 0; d < 3; ++d)
      for (int side = 0; side < 2; ++side) to.coupling[d][c + side * to.stride(d)] = static_cast<float>(*next++);
}

// The cells of the gathered level in the order in which the ranks send them.
void Multigrid::set_order() {
  const Level& to = levels_[gathered_];
  Level block;  // of another rank
  block.edges = levels_[gathered_ - 1].edges;
  const Int3 ranks = decomposition_.ranks();
  for (int rank = 0; rank < decomposition_.comm().size(); ++rank) {
    const Int3 place{rank % ranks[0], rank / ranks[0] % ranks[1], rank / (ranks[0] * ranks[1])};
    for (int d = 0; d < 3; ++d) block.place[d] = place[axis_[d]];
    const Int3 low = block.first();
    Int3 high;
    for (int d = 0; d < 3; ++d) high[d] = low[d] + static_cast<int>(block.edges[d][block.place[d]].size());
    for (int k = low[2]; k < high[2]; ++k)
      for (int j = low[1]; j < high[1]; ++j)
        for (int i = low[0]; i < high[0]; ++i) order_.push_back(to.index(i, j, k));
  }
}

}  // namespace bedflow
