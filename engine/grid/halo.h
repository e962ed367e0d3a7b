// Ghost layers of fields between blocks, and across periodic faces. Faces of the box itself are left alone: what
// stands beyond them is the boundary condition's affair.
#pragma once

#include <vector>

#include "base/phase_timer.h"
#include "grid/grid.h"

namespace bedflow {

class Halo {
 public:
  Halo(const Decomposition& decomposition, const Grid& grid, PhaseTimer& timer);

  // Ghosts become what their owners hold, edges and corners too.
  void fill(Field& field);
  void fill(FaceField& field) {
    for (Field& component : field.component) fill(component);
  }
  // The transpose of fill: what was deposited on ghosts is added to their owners, and the ghosts become 0.
  void add(Field& field);
  void add(FaceField& field) {
    for (Field& component : field.component) add(component);
  }

 private:
  struct Slab {
    Int3 low, high;
  };
  bool own_neighbour(int d) const { return decomposition_.neighbour(d, 0) == decomposition_.comm().rank(); }
  template <class Apply>
  void each_own_image(int d, Apply apply) const;
  Slab slab(int d, int from, int to) const;
  void pack(const Field& field, const Slab& slab);
  template <class Apply>
  void unpack(Field& field, const Slab& slab, Apply apply);

  const Decomposition& decomposition_;
  const Grid& grid_;
  PhaseTimer& timer_;
  std::vector<double> send_, receive_;
};

}  // namespace bedflow
