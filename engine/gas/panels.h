// Rectangles inside the box (models/boundary.h) as lists of the faces and control volumes that they change, made once.
//
// Gas does not pass a closed face. A control volume of another component that lies along one feels a wall at rest on that side,
// by the share of the side that is covered: μ A u/(h/2) instead of the exchange with the volume beyond.
#pragma once

#include "gas/boundaries.h"
#include "gas/gas_solver.h"

namespace bedflow {

class Panels {
 public:
  Panels(const Grid& grid, const Decomposition& decomposition, const Boundaries& boundaries, const std::vector<Panel>& panels);

  struct Shear {
    std::ptrdiff_t volume;
    int side;      // 2·direction + side
    double share;  // of the side of a whole volume
  };
  struct Resistance {
    std::ptrdiff_t face;
    Plate plate;
  };
  // By component: faces of this rank.
  std::array<std::vector<std::ptrdiff_t>, 3> closed;
  std::array<std::vector<Resistance>, 3> plates;
  std::array<std::vector<Shear>, 3> shear;
  // [component][direction]: sides (by the volume above) whose neighbours towards upstream or downstream may lie beyond a wall.
  std::array<std::array<std::vector<std::ptrdiff_t>, 3>, 3> beside;

  void close(FaceField& velocity) const {
    for (int d = 0; d < 3; ++d)
      for (const std::ptrdiff_t face : closed[d]) velocity[d].data()[face] = 0;
  }

  // What the panels take of the pressure in the present flow, and no particle feels as ∇p: a plate by its resistance, a baffle
  // whatever differs across it.
  void set_jumps(GasState& state, const Grid& grid, double density) const;

 private:
  void mark(const Grid& grid, const Decomposition& decomposition, const Panel& panel, FaceField& covered);
  void list_along(const Grid& grid, const Boundaries& boundaries, int component, int d, const Field& covered);
};

}  // namespace bedflow
