// The room that spheres of any sizes take, and whether there is more.
#pragma once

#include <cstdint>
#include <vector>

#include "parallel/decomposition.h"

namespace bedflow {

// Layers of cells, each for the spheres of half to all of its own largest diameter: a search looks into few cells whatever the
// ratio of the sizes.
class Occupied {
 public:
  struct Sphere {
    Vec3 centre;
    double radius = 0;  // m
  };
  // The box that holds the centres; the largest diameter and the number of spheres to come, from which the cells are chosen.
  Occupied(Vec3 low, Vec3 high, double largest, std::int64_t count);

  void add(const Sphere& sphere);
  bool is_free(const Sphere& sphere) const { return !find_overlap(sphere, 1); }
  // A sphere with its centre nearer than `share` of the sum of both radii; null: there is none.
  const Sphere* find_overlap(const Sphere& sphere, double share) const;

 private:
  struct Layer {
    double edge = 0;  // of the cells, m
    Int3 cells{};
    std::vector<std::int32_t> first;  // sphere of each cell, -1: none
  };
  void cover(Layer& layer, double diameter) const;
  Int3 cell_of(const Layer& layer, Vec3 x) const;
  static std::size_t index(const Layer& layer, Int3 cell) {
    return cell[0] + static_cast<std::size_t>(layer.cells[0]) * (cell[1] + static_cast<std::size_t>(layer.cells[1]) * cell[2]);
  }

  Vec3 low_, high_;
  double largest_;
  std::int64_t count_;
  std::vector<Layer> layers_;  // diameters (largest/2, largest], (largest/4, largest/2], …
  std::vector<Sphere> spheres_;
  std::vector<std::int32_t> next_;  // in the same cell
};

}  // namespace bedflow
