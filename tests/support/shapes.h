// Triangles, random places and contacts for tests of walls.
#pragma once

#include <random>
#include <vector>

#include "geometry/surface.h"

namespace bedflow {

// A rectangle from `corner` along two edges, as columns × rows cells of two triangles.
inline std::vector<Facet> tessellated(Vec3 corner, Vec3 along, Vec3 across, int columns, int rows) {
  std::vector<Facet> facets;
  const auto at = [&](int i, int j) {
    return corner + static_cast<double>(i) / columns * along + static_cast<double>(j) / rows * across;
  };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      facets.push_back(Facet::of({at(i, j), at(i + 1, j), at(i + 1, j + 1)}));
      facets.push_back(Facet::of({at(i, j), at(i + 1, j + 1), at(i, j + 1)}));
    }
  return facets;
}

class RandomVectors {
 public:
  explicit RandomVectors(unsigned seed) : engine_(seed) {}
  double within(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vec3 within(Vec3 low, Vec3 high) { return {within(low.x, high.x), within(low.y, high.y), within(low.z, high.z)}; }
  Vec3 direction() {
    Vec3 v;
    do v = within({-1, -1, -1}, {1, 1, 1});
    while (dot(v, v) > 1 || dot(v, v) < 0.01);
    return 1 / norm(v) * v;
  }

 private:
  std::mt19937 engine_;
};

inline std::vector<Touch> contacts(const Surface& surface, Vec3 x, double reach) {
  Touches touches;
  std::visit([&](const auto& shape) { shape.touch(x, reach, touches); }, surface);
  const Mesh* mesh = std::get_if<Mesh>(&surface);
  const auto found = touches.contacts(mesh ? mesh->rise() : smooth_rise);
  return {found.begin(), found.end()};
}

}  // namespace bedflow
