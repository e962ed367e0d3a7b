#include "grid/halo.h"

#include <algorithm>

namespace bedflow {

Halo::Halo(const Decomposition& decomposition, const Grid& grid, PhaseTimer& timer)
    : decomposition_(decomposition), grid_(grid), timer_(timer) {}

// Layers from … to−1 in d. All ghosts are included in the other directions: after x, y and z in turn edges and corners are
// right too.
Halo::Slab Halo::slab(int d, int from, int to) const {
  const int g = grid_.ghosts;
  Slab result{{-g, -g, -g}, {grid_.cells[0] + g, grid_.cells[1] + g, grid_.cells[2] + g}};
  result.low[d] = from;
  result.high[d] = to;
  return result;
}

Halo::Sides Halo::owners(int d) const {
  return {slab(d, 0, grid_.ghosts), slab(d, grid_.cells[d] - grid_.ghosts, grid_.cells[d])};
}
Halo::Sides Halo::ghosts(int d) const {
  return {slab(d, -grid_.ghosts, 0), slab(d, grid_.cells[d], grid_.cells[d] + grid_.ghosts)};
}

template <class Act>
void Halo::for_slab(Field& field, const Slab& slab, std::vector<double>& message, Act act) {
  const int n = slab.width(0);
  message.resize(slab.size());
  double* values = message.data();
  for (int k = slab.low[2]; k < slab.high[2]; ++k)
    for (int j = slab.low[1]; j < slab.high[1]; ++j, values += n) act(&field(slab.low[0], j, k), values, n);
}

// What is taken of from[s] goes to the neighbour on side s, and what that one sends is given to to[s].
template <class Take, class Give>
void Halo::exchange(Field& field, int d, const Sides& from, const Sides& to, Take take, Give give) {
  const std::array<int, 2> neighbours = {decomposition_.neighbour(d, 0), decomposition_.neighbour(d, 1)};
  for (int side = 0; side < 2; ++side) {
    if (neighbours[side] < 0) continue;
    for_slab(field, from[side], send_[side], take);
    receive_[side].resize(to[side].size());
  }
  decomposition_.comm().exchange(neighbours, send_, receive_);
  for (int side = 0; side < 2; ++side)
    if (neighbours[side] >= 0) for_slab(field, to[side], receive_[side], give);
}

// A block that is its own neighbour across a periodic face: ghost layer l stands for layer l mod n, however few there are.
template <class Apply>
void Halo::each_own_image(int d, Apply apply) const {
  const int g = grid_.ghosts, n = grid_.cells[d];
  for (int layer = -g; layer < n + g; ++layer) {
    if (layer >= 0 && layer < n) continue;
    const std::ptrdiff_t shift = (((layer % n) + n) % n - layer) * grid_.stride(d);
    const Slab ghosts = slab(d, layer, layer + 1);
    for (int k = ghosts.low[2]; k < ghosts.high[2]; ++k)
      for (int j = ghosts.low[1]; j < ghosts.high[1]; ++j)
        for (int i = ghosts.low[0]; i < ghosts.high[0]; ++i) apply(grid_.index(i, j, k), grid_.index(i, j, k) + shift);
  }
}

void Halo::fill(Field& field) {
  for (int d = 0; d < 3; ++d) {
    if (decomposition_.at_face(d, 0) && decomposition_.at_face(d, 1)) continue;
    const PhaseTimer::Scope scope(timer_, Phase::halo);
    if (own_neighbour(d)) {
      each_own_image(d, [data = field.data()](std::ptrdiff_t ghost, std::ptrdiff_t owner) { data[ghost] = data[owner]; });
      continue;
    }
    exchange(
        field, d, owners(d), ghosts(d), [](const double* here, double* out, int n) { std::copy_n(here, n, out); },
        [](double* here, const double* in, int n) { std::copy_n(in, n, here); });
  }
}

void Halo::add(Field& field) {
  for (int d = 2; d >= 0; --d) {
    if (decomposition_.at_face(d, 0) && decomposition_.at_face(d, 1)) continue;
    const PhaseTimer::Scope scope(timer_, Phase::halo);
    if (own_neighbour(d)) {
      each_own_image(d, [data = field.data()](std::ptrdiff_t ghost, std::ptrdiff_t owner) {
        data[owner] += data[ghost];
        data[ghost] = 0;
      });
      continue;
    }
    exchange(
        field, d, ghosts(d), owners(d),
        [](double* here, double* out, int n) {
          std::copy_n(here, n, out);
          std::fill_n(here, n, 0.0);
        },
        [](double* here, const double* in, int n) {
          for (int i = 0; i < n; ++i) here[i] += in[i];
        });
  }
}

}  // namespace bedflow
