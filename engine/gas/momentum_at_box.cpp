// Momentum on control volumes that touch the faces of the box.
#include <algorithm>

#include "gas/momentum.h"

namespace bedflow {

// The half control volume before an outflow. On the face nothing but p acts along the normal, and nothing across; what comes back
// starts from rest.
void Momentum::assemble_outflow(int d, int side, const double* p) {
  const std::ptrdiff_t s = grid_.stride(d);
  const double mu = setup_.viscosity, volume = grid_.cell_volume();
  const double along = mu * volume / (grid_.spacing[d] * grid_.spacing[d]);
  const double dilatation = (side == 0 ? mu : -mu) * grid_.face_area(d) / 3;
  const double* f = flux_[d].data();
  Int3 from{0, 0, 0}, to = grid_.cells;
  from[d] = side == 0 ? 0 : grid_.cells[d];
  to[d] = from[d] + 1;
  for_rows(grid_, from, to, [&](auto first, int n) {
    for (auto c = first; c < first + n; ++c) {
      const std::ptrdiff_t cell = side == 0 ? c : c - s;  // the one before the face
      const double inward = side == 0 ? 0.5 * (f[c] + f[c + s]) : -0.5 * (f[c - s] + f[c]);
      neighbour_[2 * d + 1 - side]->data()[c] = along + std::max(-inward, 0.0);
      neighbour_[2 * d + side]->data()[c] = 0;
      for (int t = 0; t < 3; ++t) {
        if (t == d) continue;
        const double across = 0.5 * mu * volume / (grid_.spacing[t] * grid_.spacing[t]);
        const double* ft = flux_[t].data();
        neighbour_[2 * t]->data()[c] = across + std::max(0.5 * ft[cell], 0.0);
        neighbour_[2 * t + 1]->data()[c] = across + std::max(-0.5 * ft[cell + grid_.stride(t)], 0.0);
      }
      diagonal_.data()[c] += std::max(side == 0 ? f[c] : -f[c], 0.0);
      source_.data()[c] =
          constant_.data()[c] + mobility_[d].data()[c] * (p[c - s] - p[c]) + dilatation * divergence_.data()[cell];
    }
  });
}

// Control volumes of component d along a face of the box in direction t: shear over the half cell to a wall or inflow, which
// have their own velocity; none to a free-slip wall or an outflow. What enters through an outflow brings none.
void Momentum::apply_boundary(int d, int t, int side) {
  const Boundary& boundary = *boundaries_.at(t, side);
  const bool fixed = std::holds_alternative<NoSlip>(boundary) || inflow_of(boundary);
  const double velocity = std::holds_alternative<NoSlip>(boundary) ? std::get<NoSlip>(boundary).velocity[d] : 0;
  const double diffusion = setup_.viscosity * grid_.cell_volume() / (grid_.spacing[t] * grid_.spacing[t]);
  double *a = neighbour_[2 * t + side]->data(), *diagonal = diagonal_.data(), *source = source_.data();
  Int3 from = low_solved(d), to = high_solved(d);
  from[t] = side == 0 ? 0 : grid_.cells[t] - 1;
  to[t] = from[t] + 1;
  const auto apply = [=, this](Int3 low, Int3 high, double share) {
    const double across = share * diffusion, shear = fixed ? 2 * across : 0;
    for_rows(grid_, low, high, [=](auto first, int n) {
      for (auto c = first; c < first + n; ++c) {
        const double entering = a[c] - across;
        diagonal[c] += shear + entering;
        source[c] += (shear + entering) * velocity;
        a[c] = 0;
      }
    });
  };
  Int3 inner_from = from, inner_to = to;
  if (boundaries_.outflow(d, 0)) {
    Int3 edge = to;
    edge[d] = 1;
    apply(from, edge, 0.5);
    inner_from[d] = 1;
  }
  if (boundaries_.outflow(d, 1)) {
    Int3 edge = from;
    edge[d] = grid_.cells[d];
    apply(edge, to, 0.5);
    inner_to[d] = grid_.cells[d];
  }
  apply(inner_from, inner_to, 1);
}

}  // namespace bedflow
