// A symmetric operator on cells that couples each with the six beside it:
//   (A x)_c = diagonal_c x_c − Σ coupling_f x_(cell beyond f)        over the faces f of the cell.
#pragma once

#include "grid/grid.h"

namespace bedflow {

struct SevenPoint {
  FaceField coupling;  // ≥ 0; by face (index: the cell's lower face), also that after the last cell; 0 on faces of the box
  Field diagonal;      // Σ coupling over the cell's faces, and more beside a face where x is given

  explicit SevenPoint(const Grid& grid) : coupling(grid), diagonal(grid) {}
};

}  // namespace bedflow
