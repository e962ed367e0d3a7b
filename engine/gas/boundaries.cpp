#include "gas/boundaries.h"

#include <algorithm>

namespace bedflow {

Boundaries::Boundaries(const Decomposition& decomposition, const Grid& grid, const std::array<std::array<Boundary, 2>, 3>& faces)
    : decomposition_(decomposition), grid_(grid), faces_(faces) {
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) cover_patches(d, side);
}

template <class Act>
void Boundaries::for_layer(int d, int side, bool wide, Act act) const {
  const int g = wide ? grid_.ghosts : 0;
  const std::ptrdiff_t out = side == 0 ? -grid_.stride(d) : grid_.stride(d);
  Int3 low{-g, -g, -g}, high{grid_.cells[0] + g, grid_.cells[1] + g, grid_.cells[2] + g};
  low[d] = side == 0 ? 0 : grid_.cells[d] - 1;
  high[d] = low[d] + 1;
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; ++j)
      for (int i = low[0]; i < high[0]; ++i) {
        const std::ptrdiff_t in = grid_.index(i, j, k);
        act(in, in + out);
      }
}

// The product over both tangential directions of the overlap of cell and rectangle, over the cell's edge.
void Boundaries::cover_patches(int d, int side) {
  const Boundary* boundary = at(d, side);
  if (!boundary || !inflow_of(*boundary)) return;
  for (const Inflow::Patch& patch : inflow_of(*boundary)->patches) {
    std::vector<double> share;
    Int3 cell{};
    const auto overlap = [&](int t) {
      const double low = grid_.low[t] + cell[t] * grid_.spacing[t], high = low + grid_.spacing[t];
      return std::max(0.0, std::min(high, patch.high[t]) - std::max(low, patch.low[t])) / grid_.spacing[t];
    };
    Int3 last = grid_.cells;
    last[d] = 1;
    for (cell[2] = 0; cell[2] < last[2]; ++cell[2])
      for (cell[1] = 0; cell[1] < last[1]; ++cell[1])
        for (cell[0] = 0; cell[0] < last[0]; ++cell[0]) share.push_back(overlap((d + 1) % 3) * overlap((d + 2) % 3));
    covered_[d][side].push_back(std::move(share));
  }
}

bool Boundaries::open() const {
  for (int d = 0; d < 3; ++d)
    for (const Boundary& face : faces_[d])
      if (!decomposition_.periodic(d) && std::holds_alternative<Outflow>(face)) return true;
  return false;
}

void Boundaries::continue_field(Field& field) const {
  double* f = field.data();
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side)
      if (at(d, side)) for_layer(d, side, true, [f](auto in, auto beyond) { f[beyond] = f[in]; });
}

void Boundaries::set_normal_velocity(FaceField& velocity, const Field& fraction, double time) const {
  const double* epsilon = fraction.data();
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) {
      const Boundary* boundary = at(d, side);
      if (!boundary || outflow(d, side)) continue;
      double* u = velocity[d].data();
      if (const Inflow* inflow = inflow_of(*boundary)) {
        const double background = inflow->jet.at(time), inward = side == 0 ? 1 : -1;
        std::size_t cell = 0;
        for_layer(d, side, false, [&](auto in, auto beyond) {
          double superficial = background;
          for (std::size_t p = 0; p < inflow->patches.size(); ++p)
            superficial += covered_[d][side][p][cell] * (inflow->patches[p].jet.at(time) - background);
          u[side == 0 ? in : beyond] = inward * superficial / epsilon[in];
          ++cell;
        });
      } else {
        for_layer(d, side, false, [&](auto in, auto beyond) { u[side == 0 ? in : beyond] = 0; });
      }
    }
}

void Boundaries::set_velocity_beyond(FaceField& velocity) const {
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) {
      const Boundary* boundary = at(d, side);
      if (!boundary) continue;
      for (int c = 0; c < 3; ++c) {
        double* u = velocity[c].data();
        if (c == d) {
          continue_normal(d, side, u);
          continue;
        }
        // Mean over the face: the wall's velocity, or 0 on inflows; no gradient otherwise.
        const bool fixed = std::holds_alternative<NoSlip>(*boundary) || inflow_of(*boundary);
        const double on_face = fixed && std::holds_alternative<NoSlip>(*boundary) ? std::get<NoSlip>(*boundary).velocity[c] : 0;
        for_layer(d, side, true, [=](auto in, auto beyond) { u[beyond] = fixed ? 2 * on_face - u[in] : u[in]; });
      }
    }
}

// One face beyond that of the box.
void Boundaries::continue_normal(int d, int side, double* u) const {
  if (side == 1 && grid_.ghosts < 2) return;  // the ghost is the face itself
  const std::ptrdiff_t out = side == 0 ? -grid_.stride(d) : grid_.stride(d);
  const bool line = !outflow(d, side);
  for_layer(d, side, true, [=](auto in, auto beyond) {
    const std::ptrdiff_t face = side == 0 ? in : beyond;
    u[face + out] = line ? 2 * u[face] - u[face - out] : u[face];
  });
}

void Boundaries::set_pressure(Field& pressure, bool on_face) const {
  double* p = pressure.data();
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) {
      const Boundary* boundary = at(d, side);
      if (!boundary) continue;
      if (const Outflow* outflow = std::get_if<Outflow>(boundary)) {
        const double there = outflow->pressure;
        for_layer(d, side, true, [=](auto in, auto beyond) { p[beyond] = on_face ? there : 2 * there - p[in]; });
      } else {
        for_layer(d, side, true, [=](auto in, auto beyond) { p[beyond] = p[in]; });
      }
    }
}

}  // namespace bedflow
