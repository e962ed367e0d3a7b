// Ghost layers of fields between blocks, and across periodic faces. Faces of the box itself are left alone: what
// stands beyond them is the boundary condition's affair.
#pragma once

#include <array>
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
    int width(int d) const { return high[d] - low[d]; }
    std::size_t size() const { return static_cast<std::size_t>(width(0)) * width(1) * width(2); }
  };
  bool own_neighbour(int d) const { return decomposition_.neighbour(d, 0) == decomposition_.comm().rank(); }
  template <class Apply>
  void each_own_image(int d, Apply apply) const;
  using Sides = std::array<Slab, 2>;
  Slab slab(int d, int from, int to) const;
  Sides owners(int d) const;  // the layers of this block that are ghosts of its neighbours
  Sides ghosts(int d) const;
  // Act(values of a row of the slab, the same in the message, how many)
  template <class Act>
  static void for_slab(Field& field, const Slab& slab, std::vector<double>& message, Act act);
  template <class Take, class Give>
  void exchange(Field& field, int d, const Sides& from, const Sides& to, Take take, Give give);

  const Decomposition& decomposition_;
  const Grid& grid_;
  PhaseTimer& timer_;
  std::array<std::vector<double>, 2> send_, receive_;
};

}  // namespace bedflow
