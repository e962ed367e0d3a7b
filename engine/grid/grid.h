// The staggered grid of one block, and fields on it.
//
// All fields of a block have one shape: nx × ny × nz cells with `ghosts` layers around them, x fastest. Index (i,j,k) of a
// centre field is the cell's centre; of a face field for direction d it is the cell's LOWER face in d. So a block owns the
// faces 0 … n−1; face n is the next block's, or, at a face of the box, the boundary itself, and lies in the first ghost layer.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "base/check.h"
#include "base/vec3.h"
#include "parallel/decomposition.h"

namespace bedflow {

struct Grid {
  Int3 cells{};   // of this block
  Int3 first{};   // global index of its first cell
  Int3 global{};  // cells of the whole box
  Vec3 spacing;   // edges of a cell, m
  Vec3 low;       // low corner of the block, m
  int ghosts = 1;

  Grid() = default;
  explicit Grid(const Decomposition& decomposition, int ghost_layers = 1)
      : cells(decomposition.cells()),
        first(decomposition.first()),
        global(decomposition.global_cells()),
        low(decomposition.low()),
        ghosts(ghost_layers) {
    for (int d = 0; d < 3; ++d) spacing[d] = decomposition.size()[d] / global[d];
  }

  int padded(int d) const { return cells[d] + 2 * ghosts; }
  std::size_t size() const { return static_cast<std::size_t>(padded(0)) * padded(1) * padded(2); }  // with ghosts
  std::ptrdiff_t stride(int d) const {
    return d == 0 ? 1 : d == 1 ? padded(0) : static_cast<std::ptrdiff_t>(padded(0)) * padded(1);
  }
  std::ptrdiff_t index(int i, int j, int k) const { return (i + ghosts) + stride(1) * (j + ghosts) + stride(2) * (k + ghosts); }
  double cell_volume() const { return spacing.x * spacing.y * spacing.z; }               // m³
  double face_area(int d) const { return spacing[(d + 1) % 3] * spacing[(d + 2) % 3]; }  // m²
  long interior() const { return static_cast<long>(cells[0]) * cells[1] * cells[2]; }
};

class Field {
 public:
  Field() = default;
  explicit Field(const Grid& grid, double value = 0) : grid_(&grid), data_(grid.size(), value) {}

  double& operator()(int i, int j, int k) { return data_[checked(i, j, k)]; }
  double operator()(int i, int j, int k) const { return data_[checked(i, j, k)]; }
  double* data() { return data_.data(); }
  const double* data() const { return data_.data(); }
  std::size_t size() const { return data_.size(); }
  void fill(double value) { std::fill(data_.begin(), data_.end(), value); }

 private:
  std::ptrdiff_t checked(int i, int j, int k) const {
    CHECK(i >= -grid_->ghosts && i < grid_->cells[0] + grid_->ghosts && j >= -grid_->ghosts &&
              j < grid_->cells[1] + grid_->ghosts && k >= -grid_->ghosts && k < grid_->cells[2] + grid_->ghosts,
          i, j, k);
    return grid_->index(i, j, k);
  }
  const Grid* grid_ = nullptr;  // outlives the field
  std::vector<double> data_;
};

// One face field a direction.
struct FaceField {
  std::array<Field, 3> component;

  FaceField() = default;
  explicit FaceField(const Grid& grid, double value = 0)
      : component{Field(grid, value), Field(grid, value), Field(grid, value)} {}
  Field& operator[](int d) { return component[d]; }
  const Field& operator[](int d) const { return component[d]; }
};

}  // namespace bedflow
