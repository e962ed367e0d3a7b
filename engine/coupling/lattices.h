// The four lattices that particles are spread over: the faces of each velocity component, and the cell centres.
//
// A face of the box is no point of a face lattice: its share folds onto the next face inside, which therefore stands for 1½ cells
// (2 between walls two cells apart), its `node volume`.
#pragma once

#include <algorithm>
#include <vector>

#include "grid/grid.h"
#include "parallel/decomposition.h"

namespace bedflow {

inline constexpr int cell_centres = 3;  // a lattice's number; those of the faces are their directions

class Lattices {
 public:
  Lattices(const Decomposition& decomposition, const Grid& grid) : grid_(grid) {
    for (int d = 0; d < 3; ++d) {
      const bool low = decomposition.at_face(d, 0), high = decomposition.at_face(d, 1);
      const int last = grid.cells[d] - 1;
      low_[0][d] = low ? 0 : -grid.ghosts;
      low_[1][d] = low ? 1 : -grid.ghosts;
      high_[d] = high ? last : last + grid.ghosts;
      node_volume_[d].assign(static_cast<std::size_t>(grid.cells[d]), 1);
      if (low && last > 0) node_volume_[d][1] += 0.5;
      if (high && last > 0) node_volume_[d][last] += 0.5;
    }
  }

  // First and last point along d where a share may go, ghosts too, of the cell centres (faces 0) or of the faces along d (faces
  // 1).
  int low(int faces, int d) const { return low_[faces][d]; }
  int high(int d) const { return high_[d]; }
  bool has_faces(int d) const { return low_[1][d] <= high_[d]; }  // false between walls one cell apart

  // Calls row(c, n) for every row along x of a lattice, ghosts too.
  template <class Row>
  void each_row(int lattice, Row row) const {
    const Int3 from{low_[lattice == 0][0], low_[lattice == 1][1], low_[lattice == 2][2]};
    for (int k = from[2]; k <= high_[2]; ++k)
      for (int j = from[1]; j <= high_[1]; ++j) row(grid_.index(from[0], j, k), high_[0] - from[0] + 1);
  }
  // Calls row(first, n) for every row along x of this rank's own points of a lattice.
  template <class Row>
  void each_owned_row(int lattice, Row row) const {
    Int3 from{0, 0, 0};
    for (int d = 0; d < 3; ++d) from[d] = std::max(0, low_[lattice == d][d]);
    const int n = grid_.cells[0] - from[0];
    if (n <= 0) return;
    for (int k = from[2]; k < grid_.cells[2]; ++k)
      for (int j = from[1]; j < grid_.cells[1]; ++j) row(Int3{from[0], j, k}, n);
  }
  // Of the faces of direction d, in cells: the node volume of entry i of a row is [i·step].
  struct NodeVolume {
    const double* first;
    int step;
    double operator[](int i) const { return first[i * step]; }
  };
  NodeVolume node_volume(int d, Int3 first) const { return {node_volume_[d].data() + first[d], d == 0}; }

 private:
  const Grid& grid_;
  Int3 low_[2]{}, high_{};
  std::vector<double> node_volume_[3];  // of this rank's own faces
};

}  // namespace bedflow
