// Systems of the pressure equation as beds make them: a bed with a bubble below, clear gas above; drag as a multiple of inertia.
#pragma once

#include <array>
#include <cmath>
#include <random>

#include "gas/conjugate_gradients.h"

namespace bedflow {

struct PressureSystem {
  struct Kind {
    Int3 cells{};
    Vec3 edge{1, 1, 1};  // of a cell
    std::array<bool, 3> periodic{false, false, false};
    bool open = true;  // x = 0 above
    bool bed = true;   // else clear gas everywhere
    double drag = 0;   // of the bed, over inertia
    int up = 1;        // direction
  };

  explicit PressureSystem(const Kind& given, const Comm& comm = Comm::self())
      : kind(given),
        decomposition(comm, kind.cells, {kind.cells[0] * kind.edge.x, kind.cells[1] * kind.edge.y, kind.cells[2] * kind.edge.z},
                      kind.periodic),
        grid(decomposition),
        halo(decomposition, grid, timer),
        matrix(grid),
        work(grid),
        right(grid) {
    for (int d = 0; d < 3; ++d) {
      Int3 high = grid.cells, at{};
      ++high[d];
      for (at[2] = 0; at[2] < high[2]; ++at[2])
        for (at[1] = 0; at[1] < high[1]; ++at[1])
          for (at[0] = 0; at[0] < high[0]; ++at[0]) matrix.coupling[d](at[0], at[1], at[2]) = coupling(d, at);
      halo.fill(matrix.coupling[d]);
    }
    for (int k = 0; k < grid.cells[2]; ++k)
      for (int j = 0; j < grid.cells[1]; ++j)
        for (int i = 0; i < grid.cells[0]; ++i) right(i, j, k) = noise({i, j, k});
  }

  // In −1 … 1; the same in a cell of the box on any number of ranks.
  double noise(Int3 at, unsigned seed = 1) const {
    const Int3 n = grid.global;
    const int cell = at[0] + grid.first[0] + n[0] * (at[1] + grid.first[1] + n[1] * (at[2] + grid.first[2]));
    std::minstd_rand random(static_cast<unsigned>(cell) * 747796405u + seed * 2891336453u);
    random.discard(3);
    return std::uniform_real_distribution<double>(-1, 1)(random);
  }
  // Σ r² over the ranks that share the box.
  double squares(const Field& r) const {
    double sum = 0;
    for_rows(grid, [&](auto c, int n) {
      for (auto i = c; i < c + n; ++i) sum += r.data()[i] * r.data()[i];
    });
    return decomposition.comm().sum(sum);
  }
  bool singular() const { return !kind.open || kind.periodic[kind.up]; }

  Kind kind;
  Decomposition decomposition;
  Grid grid;
  PhaseTimer timer;
  Halo halo;
  SevenPoint matrix;
  Workspace work;
  Field right;

 private:
  double solids(Int3 cell) const {  // 0 … 0.6
    if (!kind.bed) return 0;
    const int beside = kind.up == 0 ? 1 : 0;  // across the bubble, which is as long as the box in the third direction
    const double x = (cell[beside] + 0.5) / kind.cells[beside] - 0.5, y = (cell[kind.up] + 0.5) / kind.cells[kind.up];
    const bool bubble = x * x + (y - 0.25) * (y - 0.25) < 0.02;
    return y > 0.47 || bubble ? 0 : 0.6;
  }
  // ε A D / h with D ~ 1 / (1 + drag), both by the mean of the cells beside the face.
  double coupling(int d, Int3 at) const {
    Int3 above;
    for (int t = 0; t < 3; ++t) above[t] = at[t] + grid.first[t];
    Int3 below = above;
    --below[d];
    const bool edge = !kind.periodic[d] && (above[d] == 0 || above[d] == kind.cells[d]);
    if (edge && !(kind.open && d == kind.up && above[d] == kind.cells[d])) return 0;
    const double s = edge ? solids(below) : 0.5 * (solids(below) + solids(above));
    return (edge ? 2 : 1) * grid.face_area(d) / grid.spacing[d] * (1 - s) / (1 + kind.drag * s / 0.6);
  }
};

}  // namespace bedflow
