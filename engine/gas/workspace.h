// Fields that keep nothing from one part of a step to the next, so that the parts share them: the equations of a velocity
// component while it is assembled and solved, the vectors of the pressure's solver afterwards.
#pragma once

#include <array>

#include "grid/grid.h"

namespace bedflow {

class Workspace {
 public:
  static constexpr int size = 9;

  explicit Workspace(const Grid& grid) { fields_.fill(Field(grid)); }
  Field& operator[](int n) { return fields_[static_cast<std::size_t>(n)]; }

 private:
  std::array<Field, size> fields_;
};

}  // namespace bedflow
