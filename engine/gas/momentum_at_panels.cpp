// Momentum beside and on rectangles inside the box.
#include "gas/momentum.h"

namespace bedflow {

// Closed faces: no force counts there, and pressure moves nothing.
void Momentum::begin_panels() {
  for (int d = 0; d < 3; ++d)
    for (const std::ptrdiff_t face : panels_.closed[d]) constant_[d].data()[face] = push_[d].data()[face] = 0;
}

void Momentum::apply_panels(int d, const double* u) {
  Equations& e = equations_[d];
  double *diagonal = e.diagonal.data(), *source = e.source.data();
  for (const Panels::Shear& shear : panels_.shear[d]) {
    const double h = grid_.spacing[shear.side / 2], diffusion = setup_.viscosity * grid_.cell_volume() / (h * h);
    e.neighbour[shear.side].data()[shear.volume] -= shear.share * diffusion;
    diagonal[shear.volume] += 2 * shear.share * diffusion;
  }
  // ε_b A Δp of the plate, with |u| of the present velocity.
  const double *push = push_[d].data(), *epsilon = fraction_[d].data();
  for (const Panels::Resistance& grate : panels_.plates[d]) {
    const std::ptrdiff_t c = grate.face;
    diagonal[c] += push[c] * epsilon[c] * grate.plate.resistance(epsilon[c] * u[c], setup_.density);
  }
  for (const std::ptrdiff_t face : panels_.closed[d]) {
    for (Field& a : e.neighbour) a.data()[face] = 0;
    diagonal[face] = local_[d].data()[face];
    source[face] = 0;
  }
}

}  // namespace bedflow
