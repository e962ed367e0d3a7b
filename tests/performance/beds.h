// The bed whose particles are measured: 24 750 spheres of 2.49 mm (Goldschmidt) in a box of 150 × 450 × 15 mm with six walls,
// alone or several side by side. It is settled once and kept in the temp folder as a LAMMPS data file, so that the peers start
// from the same particles.
#pragma once

#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "particles/seeding.h"
#include "support/spheres.h"

namespace bedflow {

inline constexpr double bed_substep = 1e-5;  // s

// g points to −y.
inline Spheres bed_spheres() {
  Spheres spheres;
  spheres.diameter = 2.49e-3;
  spheres.density = 2526;
  spheres.stiffness = 2519;
  spheres.gravity = {0, -9.81, 0};
  spheres.skin = 0.1 * spheres.diameter;
  return spheres;
}

// The box shaken by 5 mm at 15 Hz: gravity becomes g + 44.4 sin(2π·15 t), here what is added to its y.
inline double shaking(double time) {
  return -44.4 * std::sin(2 * std::numbers::pi * 15 * time);
}
inline constexpr double shaking_period = 1.0 / 15;  // s

struct Bed {
  Vec3 box;
  std::vector<PlacedSphere> spheres;  // with their kind and diameter
  double height() const;              // top of the highest sphere, m
};

// At rest under gravity, so many boxes side by side in x and in z with no wall between them. Made by the first who asks.
Bed settled_bed(int along_x = 1, int along_z = 1);
std::filesystem::path settled_bed_path(int along_x, int along_z);  // where it is kept
// As many spheres in the one box, every second of half the diameter (kind 1).
Bed settled_bed_of_two_sizes();

// frictionless, coulomb, spring or hertz_mindlin for every pair of so many kinds and on the walls. E* of Hertz's contact gives it
// the overlap of the linear one at a load in the middle of the bed (0.02 N), with a Poisson ratio of 0.3.
ContactLaws bed_laws(const std::string& name, std::size_t kinds, double restitution = bed_spheres().restitution);

// The particles of a bed on this rank alone.
class BedScene {
 public:
  BedScene(const Bed& bed, const ContactLaws& laws, bool gas);
  Bed bed() const;  // as it stands; throws std::runtime_error when a particle is lost

 private:
  Decomposition decomposition_;
  PhaseTimer timer_;

 public:
  Dem dem;
};

}  // namespace bedflow
