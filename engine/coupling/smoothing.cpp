#include "coupling/smoothing.h"

#include <cmath>

namespace bedflow {

Smoothing::Smoothing(const Grid& grid, const Lattices& lattices, Halo& halo, double deviation)
    : grid_(grid), lattices_(lattices), halo_(halo), before_(grid) {
  for (int d = 0; d < 3; ++d) {
    const double h2 = grid.spacing[d] * grid.spacing[d];
    const double wanted = std::max(0.0, (deviation * deviation - h2 / 6) / (2 * h2));  // α n
    steps_[d] = static_cast<int>(std::ceil(6 * wanted));
    const double alpha = steps_[d] > 0 ? wanted / steps_[d] : 0;
    for (const int faces : {0, 1})
      for (int i = 0; i < grid.cells[d]; ++i) {
        const double node = faces ? lattices.node_volume(d, {d == 0 ? i : 0, d == 1 ? i : 0, d == 2 ? i : 0})[0] : 1;
        to_last_[faces][d].push_back(i > lattices.low(faces, d) ? alpha / node : 0);
        to_next_[faces][d].push_back(i < lattices.high(d) ? alpha / node : 0);
      }
  }
}

void Smoothing::apply(Field& field, int lattice) {
  halo_.fill(field);
  for (int d = 0; d < 3; ++d)
    for (int n = 0; n < steps_[d]; ++n) step(field, lattice, d);
}

void Smoothing::step(Field& field, int lattice, int d) {
  before_ = field;
  const double* old = before_.data();
  double* c = field.data();
  const std::ptrdiff_t s = grid_.stride(d);
  const int each = d == 0;  // the coefficients change along a row
  lattices_.each_owned_row(lattice, [&](Int3 first, int n) {
    const double* last = to_last_[lattice == d][d].data() + first[d];
    const double* next = to_next_[lattice == d][d].data() + first[d];
    const std::ptrdiff_t at = grid_.index(first[0], first[1], first[2]);
    for (int i = 0; i < n; ++i) {
      const std::ptrdiff_t p = at + i;
      c[p] = old[p] + last[i * each] * (old[p - s] - old[p]) + next[i * each] * (old[p + s] - old[p]);
    }
  });
  halo_.fill(field);
}

}  // namespace bedflow
