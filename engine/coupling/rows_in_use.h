// The rows along x of the grid that particles have shares of: in a freeboard there is nothing to deposit and nothing to sample.
#pragma once

#include <vector>

#include "grid/grid.h"

namespace bedflow {

class RowsInUse {
 public:
  // all: the sweeps leave out none. Where blocks or periodic images meet, ghosts hold what others have deposited, and where a
  // field is smoothed or the particles move between deposit and sample, it is asked for elsewhere too.
  RowsInUse(const Grid& grid, bool all)
      : cells_{grid.padded(1), grid.padded(2)}, stride_(grid.stride(1)), all_(all), now_(rows(), 1), lately_(rows(), 1) {}

  // Of the volume that has just been deposited at the cell centres: rows with any, and what is within two rows of them, which
  // holds the faces too.
  void find(const Field& solids) {
    if (all_) return;
    for (std::size_t row = 0; row < now_.size(); ++row) {
      const double* value = solids.data() + static_cast<std::ptrdiff_t>(row) * stride_;
      int found = 0;
      for (int i = 0; i < stride_; ++i) found |= value[i] != 0;
      now_[row] = found != 0;
    }
    widen(1, cells_[0]);
    widen(cells_[0], cells_[1]);
    for (std::size_t row = 0; row < now_.size(); ++row) lately_[row] |= now_[row];
  }
  // Where the particles are is not known.
  void take_all() { now_.assign(rows(), 1), lately_ = now_; }
  // Of the entry `at` of a field's data: particles have shares of its row; or have had since the last forget().
  bool now(std::ptrdiff_t at) const { return now_[static_cast<std::size_t>(at / stride_)] != 0; }
  bool lately(std::ptrdiff_t at) const { return lately_[static_cast<std::size_t>(at / stride_)] != 0; }
  // What was deposited before has been replaced everywhere.
  void forget() { lately_ = now_; }

 private:
  std::size_t rows() const { return static_cast<std::size_t>(cells_[0]) * cells_[1]; }
  // By two in a direction of so many rows, `step` apart.
  void widen(int step, int count) {
    narrow_ = now_;
    for (int row = 0; row < static_cast<int>(now_.size()); ++row) {
      const int place = row / step % count;
      for (int shift = -2; shift <= 2; ++shift)
        if (place + shift >= 0 && place + shift < count) now_[row] |= narrow_[row + shift * step];
    }
  }

  int cells_[2];  // along y and z, ghosts too
  std::ptrdiff_t stride_;
  bool all_;
  std::vector<char> now_, lately_;  // 1 or 0
  std::vector<char> narrow_;        // now_ before it is widened
};

}  // namespace bedflow
