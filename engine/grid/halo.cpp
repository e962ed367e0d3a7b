#include "grid/halo.h"

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

void Halo::pack(const Field& field, const Slab& slab) {
  send_.clear();
  for (int k = slab.low[2]; k < slab.high[2]; ++k)
    for (int j = slab.low[1]; j < slab.high[1]; ++j)
      for (int i = slab.low[0]; i < slab.high[0]; ++i) send_.push_back(field(i, j, k));
}

template <class Apply>
void Halo::unpack(Field& field, const Slab& slab, Apply apply) {
  const double* value = receive_.data();
  for (int k = slab.low[2]; k < slab.high[2]; ++k)
    for (int j = slab.low[1]; j < slab.high[1]; ++j)
      for (int i = slab.low[0]; i < slab.high[0]; ++i) apply(field(i, j, k), *value++);
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
  const int g = grid_.ghosts;
  for (int d = 0; d < 3; ++d) {
    const int n = grid_.cells[d];
    if (decomposition_.at_face(d, 0) && decomposition_.at_face(d, 1)) continue;
    const PhaseTimer::Scope scope(timer_, Phase::halo);
    if (own_neighbour(d)) {
      each_own_image(d, [data = field.data()](std::ptrdiff_t ghost, std::ptrdiff_t owner) { data[ghost] = data[owner]; });
      continue;
    }
    for (int side = 0; side < 2; ++side) {  // send towards `side`, receive from the other
      const int to = decomposition_.neighbour(d, side), from = decomposition_.neighbour(d, 1 - side);
      const Slab source = side == 0 ? slab(d, 0, g) : slab(d, n - g, n);
      const Slab target = side == 0 ? slab(d, n, n + g) : slab(d, -g, 0);
      if (to >= 0) pack(field, source);
      decomposition_.comm().exchange(to, to >= 0 ? send_ : std::vector<double>(), from, receive_);
      if (from >= 0) unpack(field, target, [](double& here, double there) { here = there; });
    }
  }
}

void Halo::add(Field& field) {
  const int g = grid_.ghosts;
  for (int d = 2; d >= 0; --d) {
    const int n = grid_.cells[d];
    if (decomposition_.at_face(d, 0) && decomposition_.at_face(d, 1)) continue;
    const PhaseTimer::Scope scope(timer_, Phase::halo);
    if (own_neighbour(d)) {
      each_own_image(d, [data = field.data()](std::ptrdiff_t ghost, std::ptrdiff_t owner) {
        data[owner] += data[ghost];
        data[ghost] = 0;
      });
      continue;
    }
    for (int side = 0; side < 2; ++side) {
      const int to = decomposition_.neighbour(d, side), from = decomposition_.neighbour(d, 1 - side);
      const Slab source = side == 0 ? slab(d, -g, 0) : slab(d, n, n + g);
      const Slab target = side == 0 ? slab(d, n - g, n) : slab(d, 0, g);
      if (to >= 0) pack(field, source);
      decomposition_.comm().exchange(to, to >= 0 ? send_ : std::vector<double>(), from, receive_);
      if (to >= 0) {
        for (int k = source.low[2]; k < source.high[2]; ++k)
          for (int j = source.low[1]; j < source.high[1]; ++j)
            for (int i = source.low[0]; i < source.high[0]; ++i) field(i, j, k) = 0;
      }
      if (from >= 0) unpack(field, target, [](double& here, double there) { here += there; });
    }
  }
}

}  // namespace bedflow
