#include "geometry/mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bedflow {

namespace {

constexpr std::uint32_t leaf_size = 4;
constexpr int deepest_tree = 64;  // halves: 2^64 facets

Vec3 middle(const Facet& facet) {
  return 1.0 / 3 * (facet.corners[0] + facet.corners[1] + facet.corners[2]);
}

double distance2_to_box(Vec3 x, Vec3 low, Vec3 high) {
  double sum = 0;
  for (int d = 0; d < 3; ++d) {
    const double beyond = std::max({low[d] - x[d], x[d] - high[d], 0.0});
    sum += beyond * beyond;
  }
  return sum;
}

}  // namespace

Mesh::Mesh(std::vector<Facet> facets, double feature_angle) : facets_(std::move(facets)), rise_(std::sin(0.5 * feature_angle)) {
  nodes_.reserve(facets_.size());
  grow(0, static_cast<std::uint32_t>(facets_.size()));
}

// Halves the facets at the median of the direction in which their box is longest.
std::uint32_t Mesh::grow(std::uint32_t first, std::uint32_t count) {
  constexpr double far = std::numeric_limits<double>::infinity();
  Node node{{far, far, far}, {-far, -far, -far}, first, count, 0};
  for (std::uint32_t f = first; f < first + count; ++f)
    for (const Vec3& corner : facets_[f].corners)
      for (int d = 0; d < 3; ++d) {
        node.low[d] = std::min(node.low[d], corner[d]);
        node.high[d] = std::max(node.high[d], corner[d]);
      }
  const auto here = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back(node);
  if (count <= leaf_size) return here;
  const Vec3 edges = node.high - node.low;
  const int longest = edges.x >= edges.y && edges.x >= edges.z ? 0 : edges.y >= edges.z ? 1 : 2;
  const auto begin = facets_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count,
                   [&](const Facet& a, const Facet& b) { return middle(a)[longest] < middle(b)[longest]; });
  grow(first, count / 2);
  const std::uint32_t second = grow(first + count / 2, count - count / 2);
  nodes_[here].second = second;
  return here;
}

void Mesh::touch(Vec3 x, double reach, Touches& touches) const {
  std::vector<std::uint32_t> numbers;
  near(x, reach, numbers);
  touch(x, reach, numbers, touches);
}

bool Mesh::near(Vec3 x, double reach, std::vector<std::uint32_t>& numbers) const {
  const std::size_t before = numbers.size();
  std::uint32_t open[deepest_tree];
  int count = 0;
  open[count++] = 0;
  while (count > 0) {
    const std::uint32_t here = open[--count];
    const Node& node = nodes_[here];
    if (!(distance2_to_box(x, node.low, node.high) < reach * reach)) continue;
    if (node.second > 0) {
      open[count++] = node.second;
      open[count++] = here + 1;
      continue;
    }
    for (std::uint32_t f = node.first; f < node.first + node.count; ++f)
      if (facets_[f].nearest(x).distance < reach) numbers.push_back(f);
  }
  return numbers.size() > before;
}

}  // namespace bedflow
