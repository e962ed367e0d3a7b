// The conditions on the faces of the box (models/boundary.h) as values on boundary faces and in the ghosts beyond them.
//
// Normal velocity on the face: 0 on walls, the superficial velocity over ε on inflows, solved for on outflows; beyond the face it
// goes on as a line, or without gradient after an outflow. Tangential velocity, ε and p continue beyond it so that their mean, or
// difference, over the face is what the condition says.
#pragma once

#include <array>
#include <vector>

#include "grid/grid.h"
#include "models/boundary.h"

namespace bedflow {

class Boundaries {
 public:
  Boundaries(const Decomposition& decomposition, const Grid& grid, const std::array<std::array<Boundary, 2>, 3>& faces);

  // The condition on a face of the box that this block touches; null where there is a neighbour.
  const Boundary* at(int d, int side) const { return decomposition_.at_face(d, side) ? &faces_[d][side] : nullptr; }
  bool outflow(int d, int side) const { return at(d, side) && std::holds_alternative<Outflow>(*at(d, side)); }
  // Whether gas can leave the box anywhere, on any rank.
  bool open() const;

  // Local indices, inclusive, of the faces of component d with a momentum equation; low > high: none.
  int first_solved(int d) const { return at(d, 0) && !outflow(d, 0) ? 1 : 0; }
  int last_solved(int d) const { return outflow(d, 1) ? grid_.cells[d] : grid_.cells[d] - 1; }

  // ε (or another centre field) beyond the faces of the box: as in the cell before them.
  void continue_field(Field& field) const;
  // Normal velocity on walls and inflows at a time (s).
  void set_normal_velocity(FaceField& velocity, const Field& fraction, double time) const;
  // Tangential velocity beyond the faces, and normal velocity beyond the face itself as far as the grid has ghosts.
  void set_velocity_beyond(FaceField& velocity) const;
  // p beyond outflows is the pressure ON the face (on_face), or what gives the gradient at the face by the difference of centres;
  // beyond others it is as in the cell before them.
  void set_pressure(Field& pressure, bool on_face) const;

 private:
  // act(in, c): the cell before the face and the one beyond; ghosts of the other directions included where wide.
  template <class Act>
  void for_layer(int d, int side, bool wide, Act act) const;
  void cover_patches(int d, int side);
  void continue_normal(int d, int side, double* u) const;

  const Decomposition& decomposition_;
  const Grid& grid_;
  std::array<std::array<Boundary, 2>, 3> faces_;
  // [face][patch]: the share of each cell of the face that the patch covers, in for_layer's order.
  std::array<std::array<std::vector<std::vector<double>>, 2>, 3> covered_;
};

}  // namespace bedflow
