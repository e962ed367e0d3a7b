// Rectangles inside the box (models/boundary.h) as the transfer sees them: what a particle gives to the grid, and takes from it,
// stays on its side.
//
// Beyond a rectangle a particle has no share of a cell, nor of a face; of the faces that a baffle closes none either, where no
// velocity is solved: its shares fold onto the next point on its own side. Beside the rim, a particle may reach around it.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "grid/grid.h"
#include "models/boundary.h"
#include "parallel/decomposition.h"

namespace bedflow {

class Fences {
 public:
  // Of the panels those within reach of the block, repeated across periodic faces.
  Fences(const Decomposition& decomposition, const Grid& grid, const std::vector<Panel>& panels) {
    for (const Panel& panel : panels)
      for (int i = -decomposition.periodic(0); i <= decomposition.periodic(0); ++i)
        for (int j = -decomposition.periodic(1); j <= decomposition.periodic(1); ++j)
          for (int k = -decomposition.periodic(2); k <= decomposition.periodic(2); ++k) add(grid, panel, {i, j, k});
  }

  bool empty() const { return fences_.empty(); }

  // Narrows the lattice points low … high along d, of cells or faces (1), to those on the side of a particle at s, in cells from
  // the block's low corner.
  void narrow(Vec3 s, int d, int faces, int& low, int& high) const {
    for (const Fence& fence : fences_) {
      if (fence.normal != d || !fence.beside(s)) continue;
      if (s[d] >= fence.face)
        low = std::max(low, fence.face + (faces == 1 && fence.closed ? 1 : 0));
      else
        high = std::min(high, fence.face - (faces == 1 && !fence.closed ? 0 : 1));
    }
  }

 private:
  struct Fence {
    int normal, face;  // index of the faces in its plane
    bool closed;
    Vec3 low, high;  // in cells
    bool beside(Vec3 s) const {
      for (int t = 0; t < 3; ++t)
        if (t != normal && (s[t] < low[t] || s[t] >= high[t])) return false;
      return true;
    }
  };
  void add(const Grid& grid, const Panel& panel, Int3 image) {
    Fence fence{0, 0, std::holds_alternative<Baffle>(panel.kind), {}, {}};
    for (int d = 0; d < 3; ++d) {
      const double shift = static_cast<double>(image[d]) * grid.global[d] - grid.first[d];
      fence.low[d] = std::round(panel.low[d] / grid.spacing[d]) + shift;
      fence.high[d] = std::round(panel.high[d] / grid.spacing[d]) + shift;
      if (fence.low[d] == fence.high[d]) fence.normal = d;
      if (fence.low[d] > grid.cells[d] + grid.ghosts || fence.high[d] < -grid.ghosts) return;
    }
    fence.face = static_cast<int>(fence.low[fence.normal]);
    fences_.push_back(fence);
  }

  std::vector<Fence> fences_;
};

}  // namespace bedflow
