#include "geometry/cut_cells.h"

namespace bedflow {

namespace {

// The part of a plane within a cell: a square of the plane that is larger than the cell, cut by the cell's six faces
// (Sutherland & Hodgman 1974). Empty or with three corners at least.
std::vector<Vec3> plane_in_cell(Vec3 point, Vec3 normal, Vec3 low, Vec3 high) {
  Vec3 other;
  other[std::abs(normal.x) < 0.6 ? 0 : 1] = 1;
  Vec3 u = cross(normal, other);
  u *= 1 / norm(u);
  const Vec3 v = cross(normal, u);
  const double size = 2 * norm(high - low), slack = 1e-12 * size;  // a plane between two cells is in both
  std::vector<Vec3> polygon{point - size * u - size * v, point + size * u - size * v, point + size * u + size * v,
                            point - size * u + size * v};
  for (int face = 0; face < 6; ++face) {
    const int d = face / 2;
    const auto depth = [&](Vec3 x) { return slack + (face % 2 == 0 ? x[d] - low[d] : high[d] - x[d]); };
    std::vector<Vec3> kept;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vec3 from = polygon[k], to = polygon[(k + 1) % polygon.size()];
      const double from_depth = depth(from), to_depth = depth(to);
      if (from_depth >= 0) kept.push_back(from);
      if ((from_depth >= 0) != (to_depth >= 0)) kept.push_back(from + from_depth / (from_depth - to_depth) * (to - from));
    }
    polygon = std::move(kept);
  }
  return polygon.size() >= 3 ? polygon : std::vector<Vec3>{};
}

}  // namespace

std::vector<Facet> cut_cells(const Surface& surface, std::array<int, 3> cells, Vec3 edges) {
  std::vector<Facet> facets;
  Touches touches;
  const double half_diagonal = 0.5 * norm(edges);
  for (int k = 0; k < cells[2]; ++k)
    for (int j = 0; j < cells[1]; ++j)
      for (int i = 0; i < cells[0]; ++i) {
        const Vec3 low{i * edges.x, j * edges.y, k * edges.z}, high = low + edges;
        touches.clear();
        std::visit([&](const auto& shape) { shape.touch(0.5 * (low + high), half_diagonal, touches); }, surface);
        if (touches.empty()) continue;
        const Touch nearest = touches.contacts()[0];
        const std::vector<Vec3> polygon = plane_in_cell(nearest.point, nearest.normal, low, high);
        for (std::size_t c = 2; c < polygon.size(); ++c)
          facets.push_back({{polygon[0], polygon[c - 1], polygon[c]}, nearest.normal});
      }
  return facets;
}

}  // namespace bedflow
