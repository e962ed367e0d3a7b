// A symmetric operator on cells that couples each with the six beside it:
//   (A x)_c = Σ coupling_f (x_c − x_(cell beyond f))        over the faces f of the cell.
// Beyond the faces of the box x is 0: a face with a coupling there holds x to it.
#pragma once

#include "grid/grid.h"

namespace bedflow {

struct SevenPoint {
  FaceField coupling;  // ≥ 0; by face (index: the cell's lower face), also that after the last cell

  explicit SevenPoint(const Grid& grid) : coupling(grid) {}
};

}  // namespace bedflow
