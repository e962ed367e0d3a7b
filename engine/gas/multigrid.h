// A multigrid V-cycle as a symmetric preconditioner, M, of the 7-point operator on cells.
//
// Cells are joined by twos in the directions in which they are narrow, in all once they are cubes, and within the ranks' blocks
// as long as there is much to do; the few thousand cells that are left are gathered on every rank and treated there alike. Some
// dozens are solved by the inverse matrix.
//
//   residual of a coarse cell: the sum over its cells         correction of a cell: that of its coarse cell
//   coupling of a coarse face: the sum over its faces × distance of the fine centres / distance of the coarse ones
//
// which is Galerkin's operator of constant interpolation, with the over-correction of smooth errors taken out (Braess 1995): it
// couples six cells again, and whatever the coefficients jump by, no error is corrected by more than the distances' ratio. Flat
// or long cells are not joined in a narrow direction but smoothed by lines (multigrid_lines.cpp), unless these are cut by ranks
// or close on themselves. Where they are, a barrier inside a pair counts too, in series, to a third at the least: a bubble's thin
// roof still stands on the coarse levels. Smoothing is Gauss–Seidel in red and black, over-relaxed (Yavneh 1996), in reverse
// order after the coarse correction, and more of it on coarser levels, which cost little. M is symmetric and positive
// (semi)definite, on any number of ranks. In single precision: M need not be exact, and half the bytes are half the time.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "gas/seven_point.h"

namespace bedflow {

class Multigrid {
 public:
  // upright: the direction across which the barriers lie, that of gravity; -1: none is known.
  Multigrid(const Decomposition& decomposition, const Grid& grid, int upright);

  // The coefficients of all levels. Collective.
  void factor(const SevenPoint& matrix);
  // z = M⁻¹ r; r is of about this magnitude, by which it is divided for single precision. Collective.
  void apply(const Field& r, double magnitude, Field& z);

  std::size_t levels() const { return levels_.size(); }
  std::size_t bytes() const;

 private:
  static constexpr int widest_register = 16;  // lines beside each other fill it; where they do not, joining costs less

  using Edges = std::vector<std::vector<float>>;  // along a direction: of the cells of each block, in edges of the finest cells
  struct Level {
    Int3 cells{}, global{};  // of this rank and of the box; the same once gathered
    Int3 joined{1, 1, 1};    // cells of this level in one of the next
    int lines = -1;          // direction of the lines that are smoothed as a whole; -1: single cells are
    int half_sweeps = 0;     // of the smoothing before the coarse correction, and as many after it; at least two
    Int3 place{};            // of this rank's block
    int parity = 0;          // of its first cell
    std::array<Edges, 3> edges;
    std::array<std::array<int, 2>, 3> neighbour{};  // the rank beyond; -1: nobody
    // A layer of ghosts around the cells, x fastest. Rows have an odd length, so that the colours of a layer of cells along z
    // take turns throughout: it is swept as one long row, in which a ghost has no relaxation and stays as it is.
    std::array<std::vector<float>, 3> coupling;  // by the cell's lower face
    std::array<std::vector<float>, 3> nearer;    // of faces along a direction: distance of the finer level's centres over its own
    std::vector<float> inverse;                  // relaxation over the diagonal; 0: a cell that touches no other
    std::vector<float> x, b;                     // correction and right side

    std::ptrdiff_t stride(int d) const {
      const std::ptrdiff_t row = (cells[0] + 2) | 1;
      return d == 0 ? 1 : d == 1 ? row : row * (cells[1] + 2);
    }
    std::ptrdiff_t layer() const { return stride(1) * (cells[1] - 1) + cells[0]; }  // from its first cell to its last

    std::ptrdiff_t index(int i, int j, int k) const { return (i + 1) + stride(1) * (j + 1) + stride(2) * (k + 1); }
    std::ptrdiff_t section() const {  // of lines that are solved together, and a row before and after it
      return lines < 0 ? 0 : static_cast<std::ptrdiff_t>(cells[lines] + 2) * cells[0];
    }
    Int3 first() const;              // index of the block's first cell in the box
    float edge(int d, int i) const;  // of a cell or a ghost; 0 beyond the box
    Int3 end(Int3 low) const;        // of the cells that are joined with cell `low` in one of the next level
  };

  void add_level(const std::array<Edges, 3>& edges, Int3 place, bool whole);
  bool choose_joined(Level& level, bool whole) const;
  void choose_axes(bool whole);
  int line_direction(const Int3& cells, bool whole, int first) const;
  void measure(const Level& fine, Level& coarse) const;
  void coarsen(const Level& fine, Level& coarse) const;
  float diagonal_of(const Level& level, Int3 at) const;
  void invert(Level& level) const;
  void factor_lines(Level& level) const;
  void gather_couplings(const Level& from, Level& to);
  void set_order();

  void invert_coarsest();
  void solve_coarsest();
  void cycle(std::size_t l);
  void gather(const Level& part, Level& whole);
  static void take_part(const Level& whole, Level& part);
  void fill_ghosts(Level& level, int colour);
  void start(Level& level);
  void relax(Level& level, int colour);
  void relax_lines(Level& level, int colour);
  void restrict_residual(Level& fine, Level& coarse);
  void prolong(const Level& coarse, Level& fine);

  double size(int d) const { return decomposition_.size()[axis_[d]]; }
  bool periodic(int d) const { return decomposition_.periodic(axis_[d]); }
  // row(c, step, l, n): n cells from low corner on along the levels' first direction, the first of which is entry c of a field,
  // `step` apart, and l of the finest level; cells 0 … high−1 of that level.
  template <class Row>
  void for_finest(const Int3& high, Row row) const {
    const std::ptrdiff_t s[3] = {grid_.stride(axis_[0]), grid_.stride(axis_[1]), grid_.stride(axis_[2])};
    for (int k = 0; k < high[2]; ++k)
      for (int j = 0; j < high[1]; ++j) row(grid_.index(0, 0, 0) + j * s[1] + k * s[2], s[0], levels_[0].index(0, j, k), high[0]);
  }

  const Decomposition& decomposition_;
  const Grid& grid_;
  int upright_;
  Int3 axis_{0, 1, 2};  // of the box, by the direction of a level
  std::vector<Level> levels_;
  std::size_t gathered_ = 0;               // the first level that is gathered; 0: none is
  double scale_ = 1;                       // of the couplings in single precision
  std::vector<std::ptrdiff_t> order_;      // cells of the gathered level as the ranks send them
  std::vector<std::ptrdiff_t> coarsest_;   // cells of the last level
  std::vector<float> solution_, inverse_;  // of its matrix, symmetric: a row for each
  std::vector<double> matrix_, diagonal_, pivot_row_;
  std::vector<float> row_;
  std::vector<double> part_;  // of a level to be gathered
  std::array<std::vector<float>, 2> send_, receive_;
};

}  // namespace bedflow
