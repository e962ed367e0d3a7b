// Momentum beside and on rectangles inside the box.
#include "gas/momentum.h"

namespace bedflow {

void Momentum::apply_panels(int d, const GasState& state) {
  double *diagonal = diagonal_.data(), *source = source_.data();
  for (const Panels::Shear& shear : panels_.shear[d]) {
    const double h = grid_.spacing[shear.side / 2], diffusion = setup_.viscosity * grid_.cell_volume() / (h * h);
    neighbour_[shear.side]->data()[shear.volume] -= shear.share * diffusion;
    diagonal[shear.volume] += 2 * shear.share * diffusion;
  }
  // ε_b A Δp of the plate, with |u| of the present velocity.
  const double *push = mobility_[d].data(), *epsilon = state.fraction.data(), *u = state.velocity[d].data();
  for (const Panels::Resistance& grate : panels_.plates[d]) {
    const std::ptrdiff_t c = grate.face;
    const double fraction = 0.5 * (epsilon[c - grid_.stride(d)] + epsilon[c]);
    diagonal[c] += push[c] * fraction * grate.plate.resistance(fraction * u[c], setup_.density);
  }
  for (const std::ptrdiff_t face : panels_.closed[d]) {  // u stays 0, whatever the diagonal
    for (Field* a : neighbour_) a->data()[face] = 0;
    source[face] = 0;
  }
}

}  // namespace bedflow
