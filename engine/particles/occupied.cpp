#include "particles/occupied.h"

#include <algorithm>
#include <cmath>

namespace bedflow {

Occupied::Occupied(Vec3 low, Vec3 high, double largest, std::int64_t count)
    : low_(low), high_(high), largest_(largest), count_(count) {}

// Cells no narrower than the diameter, at most a few a sphere.
void Occupied::cover(Layer& layer, double diameter) const {
  const Vec3 extent = high_ - low_;
  layer.edge = diameter;
  const auto cells = [&](int d) { return std::floor(extent[d] / layer.edge) + 1; };
  while (cells(0) * cells(1) * cells(2) > 64 + 8 * static_cast<double>(count_)) layer.edge *= 1.25;
  for (int d = 0; d < 3; ++d) layer.cells[d] = static_cast<int>(cells(d));
  layer.first.assign(static_cast<std::size_t>(layer.cells[0]) * layer.cells[1] * layer.cells[2], -1);
}

Int3 Occupied::cell_of(const Layer& layer, Vec3 x) const {
  Int3 cell{};
  for (int d = 0; d < 3; ++d)
    cell[d] = std::clamp(static_cast<int>(std::floor((x[d] - low_[d]) / layer.edge)), 0, layer.cells[d] - 1);
  return cell;
}

void Occupied::add(const Sphere& sphere) {
  const int level = std::max(0, std::ilogb(largest_ / (2 * sphere.radius)));
  for (int l = static_cast<int>(layers_.size()); l <= level; ++l) layers_.emplace_back();
  Layer& layer = layers_[level];
  if (layer.first.empty()) cover(layer, std::ldexp(largest_, -level));
  std::int32_t& first = layer.first[index(layer, cell_of(layer, sphere.centre))];
  next_.push_back(first);
  first = static_cast<std::int32_t>(spheres_.size());
  spheres_.push_back(sphere);
}

const Occupied::Sphere* Occupied::find_overlap(const Sphere& sphere, double share) const {
  for (std::size_t level = 0; level < layers_.size(); ++level) {
    const Layer& layer = layers_[level];
    if (layer.first.empty()) continue;
    const double reach = sphere.radius + 0.5 * std::ldexp(largest_, -static_cast<int>(level));
    const Vec3 around{reach, reach, reach};
    const Int3 from = cell_of(layer, sphere.centre - around), to = cell_of(layer, sphere.centre + around);
    for (int k = from[2]; k <= to[2]; ++k)
      for (int j = from[1]; j <= to[1]; ++j)
        for (int i = from[0]; i <= to[0]; ++i)
          for (std::int32_t n = layer.first[index(layer, {i, j, k})]; n >= 0; n = next_[n]) {
            const Vec3 apart = sphere.centre - spheres_[n].centre;
            const double touch = share * (sphere.radius + spheres_[n].radius);
            if (dot(apart, apart) < touch * touch) return &spheres_[n];
          }
  }
  return nullptr;
}

}  // namespace bedflow
