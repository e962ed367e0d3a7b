// The box cut into blocks of cells, one a rank.
#pragma once

#include <array>
#include <vector>

#include "base/vec3.h"
#include "parallel/comm.h"

namespace bedflow {

using Int3 = std::array<int, 3>;

// In each direction the first cell of every block, in order, and the number of cells: {0, …, cells}.
using Cuts = std::array<std::vector<int>, 3>;

// Blocks as equal as whole cells allow, their cuts of the least area. cells: of the whole box; size: its edges in m; tall: the
// direction that is cut only when the others cannot be (up: beds are dense below and empty above), or -1. narrowest: no block
// gets fewer cells a direction. Throws Stop(invalid_case) when the ranks cannot be placed.
Cuts even_cuts(int ranks, Int3 cells, Vec3 size, int tall = -1, Int3 narrowest = {1, 1, 1});

// Contiguous parts of the cells of one direction, at least `narrowest` cells each, so that the dearest part is as cheap as can
// be; of those that are, the one whose cuts are lowest. cost: of each cell, none negative.
std::vector<int> cheapest_cuts(const std::vector<double>& cost, int parts, int narrowest);

class Decomposition {
 public:
  // The low corner of the box is at the origin.
  Decomposition(Comm comm, Vec3 size, std::array<bool, 3> periodic, Cuts cuts);
  Decomposition(const Comm& comm, Int3 cells, Vec3 size, std::array<bool, 3> periodic, int tall = -1, Int3 narrowest = {1, 1, 1})
      : Decomposition(comm, size, periodic, even_cuts(comm.size(), cells, size, tall, narrowest)) {}

  const Comm& comm() const { return comm_; }
  const Cuts& cuts() const { return cuts_; }
  Int3 ranks() const { return ranks_; }  // blocks a direction
  Int3 place() const { return place_; }  // of this rank's block among them
  Int3 global_cells() const { return global_cells_; }
  Int3 first() const { return first_; }                                                // this block's first cell
  Int3 cells() const { return cells_; }                                                // this block's cells
  int cells(int d, int place) const { return cuts_[d][place + 1] - cuts_[d][place]; }  // of the blocks at that place
  Vec3 size() const { return size_; }                                                  // of the whole box, m
  Vec3 low() const { return low_; }                                                    // this block's corners, m
  Vec3 high() const { return high_; }
  bool periodic(int d) const { return periodic_[d]; }

  // Rank of the block beside this one; -1 beyond a face of the box. side: 0 low, 1 high.
  int neighbour(int d, int side) const { return neighbour_[d][side]; }
  bool at_face(int d, int side) const { return neighbour_[d][side] < 0; }
  // Whether the step to that neighbour crosses a periodic face.
  bool wraps(int d, int side) const { return periodic_[d] && place_[d] == (side == 0 ? 0 : ranks_[d] - 1); }

  // Rank whose block holds the point; points beyond the box count to the nearest block.
  int owner(Vec3 point) const;
  // The cell of the box in direction d that holds x (m); beyond the box the nearest.
  int cell_of(int d, double x) const;

 private:
  int rank_at(Int3 place) const { return place[0] + ranks_[0] * (place[1] + ranks_[1] * place[2]); }

  Comm comm_;
  Cuts cuts_;
  Int3 ranks_{1, 1, 1}, place_{}, global_cells_{}, first_{}, cells_{};
  Vec3 size_, low_, high_;
  std::array<bool, 3> periodic_{};
  std::array<std::array<int, 2>, 3> neighbour_{};
};

}  // namespace bedflow
