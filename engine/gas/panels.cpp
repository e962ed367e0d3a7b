#include "gas/panels.h"

#include <algorithm>
#include <cmath>

namespace bedflow {

namespace {

template <class Act>
void for_range(const Grid& grid, Int3 low, Int3 high, Act act) {
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; ++j)
      for (int i = low[0]; i < high[0]; ++i) act(Int3{i, j, k}, grid.index(i, j, k));
}

}  // namespace

Panels::Panels(const Grid& grid, const Decomposition& decomposition, const Boundaries& boundaries,
               const std::vector<Panel>& panels) {
  if (panels.empty()) return;
  FaceField covered(grid);  // 1: closed
  for (const Panel& panel : panels) mark(grid, decomposition, panel, covered);
  for (int d = 0; d < 3; ++d) {
    for_range(grid, {0, 0, 0}, grid.cells, [&](Int3, std::ptrdiff_t face) {
      if (covered[d].data()[face] > 0) closed[d].push_back(face);
    });
    std::erase_if(plates[d], [&](const Resistance& plate) { return covered[d].data()[plate.face] > 0; });
    for (int component = 0; component < 3; ++component) list_along(grid, boundaries, component, d, covered[d]);
  }
}

// Its faces in the block and in the ghosts, by their place in the whole box.
void Panels::mark(const Grid& grid, const Decomposition& decomposition, const Panel& panel, FaceField& covered) {
  int normal = 0;
  Int3 from{}, to{};
  for (int d = 0; d < 3; ++d) {
    from[d] = static_cast<int>(std::lround(panel.low[d] / grid.spacing[d]));
    to[d] = static_cast<int>(std::lround(panel.high[d] / grid.spacing[d]));
    if (from[d] == to[d]) normal = d;
  }
  ++to[normal];
  const int g = grid.ghosts;
  for_range(grid, {-g, -g, -g}, {grid.cells[0] + g, grid.cells[1] + g, grid.cells[2] + g}, [&](Int3 at, std::ptrdiff_t face) {
    bool own = true;
    for (int d = 0; d < 3; ++d) {
      int place = grid.first[d] + at[d];
      if (decomposition.periodic(d)) place = (place + grid.global[d]) % grid.global[d];
      if (place < from[d] || place >= to[d]) return;
      own = own && at[d] >= 0 && at[d] < grid.cells[d];
    }
    if (const Plate* plate = std::get_if<Plate>(&panel.kind)) {
      if (own) plates[normal].push_back({face, *plate});
    } else {
      covered[normal].data()[face] = 1;
    }
  });
}

// Control volumes of a component beside closed faces of direction d.
void Panels::list_along(const Grid& grid, const Boundaries& boundaries, int component, int d, const Field& covered) {
  const std::ptrdiff_t across = grid.stride(component), s = grid.stride(d);
  const int n = grid.cells[d];
  Int3 low{0, 0, 0}, high = grid.cells;
  low[component] = boundaries.first_solved(component);
  high[component] = boundaries.last_solved(component) + 1;
  low[d] = -1;
  high[d] = std::min(n + 2, n + grid.ghosts);
  for_range(grid, low, high, [&](Int3 at, std::ptrdiff_t face) {
    const auto list = [&](int from, int to) {
      for (int side = std::max(from, 0); side <= std::min(to, n); ++side)
        beside[component][d].push_back(face + (side - at[d]) * s);
    };
    if (component == d) {
      if (covered.data()[face] > 0) list(at[d], at[d] + 1);
      return;
    }
    // Half the volume lies before the face that it is named by, half after it; on an outflow one half is there.
    const bool before = !(at[component] == 0 && boundaries.outflow(component, 0));
    const bool after = !(at[component] == grid.cells[component] && boundaries.outflow(component, 1));
    const double share = 0.5 * ((before ? covered.data()[face - across] : 0) + (after ? covered.data()[face] : 0));
    if (share == 0) return;
    if (at[d] >= 0 && at[d] < n) shear[component].push_back({face, 2 * d, share});
    if (at[d] >= 1 && at[d] <= n) shear[component].push_back({face - s, 2 * d + 1, share});
    list(at[d] - 1, at[d] + 1);
  });
}

void Panels::set_jumps(GasState& state, const Grid& grid, double density) const {
  const double *epsilon = state.fraction.data(), *p = state.pressure.data();
  for (int d = 0; d < 3; ++d) {
    if (plates[d].empty() && closed[d].empty()) continue;
    if (!state.jump) state.jump.emplace(grid);
    const double *u = state.velocity[d].data(), fall = state.fall[d] * grid.spacing[d];
    const std::ptrdiff_t s = grid.stride(d);
    double* jump = (*state.jump)[d].data();
    for (const Resistance& grate : plates[d]) {
      const double superficial = 0.5 * (epsilon[grate.face - s] + epsilon[grate.face]) * u[grate.face];
      jump[grate.face] = grate.plate.resistance(superficial, density) * superficial;
    }
    for (const std::ptrdiff_t face : closed[d]) jump[face] = p[face - s] - p[face] + fall;
  }
}

}  // namespace bedflow
