// A wall of flat triangles and the tree of boxes that finds those near a place.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/facet.h"

namespace bedflow {

class Mesh {
 public:
  explicit Mesh(std::vector<Facet> facets, double feature_angle = 0.5235987755982988);  // φ of touch.h, rad

  const std::vector<Facet>& facets() const { return facets_; }  // in the order of the tree
  double rise() const { return rise_; }                         // sin(φ/2)

  // Appends the numbers of the facets nearer than `reach` to x: those that a sphere can touch while it and the wall move
  // little. Returns whether there are any.
  bool near(Vec3 x, double reach, std::vector<std::uint32_t>& numbers) const;

  void touch(Vec3 x, double reach, std::span<const std::uint32_t> numbers, Touches& touches) const {
    for (const std::uint32_t number : numbers)
      if (const Touch touch = facets_[number].nearest(x); touch.distance < reach) touches.add(touch);
  }
  void touch(Vec3 x, double reach, Touches& touches) const;  // of all facets; allocates
  // A sheet may be passed by its rim, and a particle within a closed body is near no facet: nobody is told to have passed.
  bool passed(Vec3 /*x*/) const { return false; }
  Bounds bounds() const { return {nodes_[0].low, nodes_[0].high}; }

 private:
  // A node's children stand behind it, the first directly; a leaf holds facets.
  struct Node {
    Vec3 low, high;
    std::uint32_t first = 0, count = 0;  // facets
    std::uint32_t second = 0;            // the other child; 0: a leaf
  };
  std::uint32_t grow(std::uint32_t first, std::uint32_t count);

  std::vector<Facet> facets_;
  std::vector<Node> nodes_;
  double rise_;
};

}  // namespace bedflow
