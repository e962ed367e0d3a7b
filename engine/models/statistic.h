// Statistics: what a monitor observes at the end of a step.
//
// Each is a struct that adds what one particle, or one cell of the gas grid, contributes to a few sums over all ranks, and turns
// the sums into its value: one number, or one a place of a profile. A value that does not exist (the mean of no particles) is
// NaN.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <variant>
#include <vector>

#include "base/vec3.h"

namespace bedflow {

// What a statistic needs to know of the scene.
struct StatisticScene {
  Vec3 size;                   // edges of the box, m
  std::array<int, 3> cells{};  // of the whole gas grid
};
struct ParticleValues {
  Vec3 position, velocity;      // m, m/s
  Vec3 spin;                    // ω, rad/s; 0 without rotation
  double radius = 0, mass = 0;  // m, kg
  int type = 0;
};
// Of the step itself, the same on every rank.
struct StepValues {
  double max_overlap = 0;  // over the diameter
  double mass_residual = 0, momentum_residual = 0;
  double mass_entered = 0, mass_left = 0;  // particles, since time 0, kg
};

// What a statistic looks at. It has
//   particles           add(scene, particle, sums)
//   pressure, fraction  weight(scene, row) of a row of cells, and the slot(column) of the sums that a column goes to
//   walls               wall, and add(force, torque, sums) of what the particles do to it
//   step                value(step)
// and, where it is more than one number from one sum, sums(scene), places(scene) and finish(scene, sums, values).
enum class Subject { particles, pressure, fraction, walls, step };

// E = Σ ½ m V² + ½ I ω²,   I = (2/5) m r²
struct KineticEnergy {
  static constexpr const char* name = "kinetic_energy";
  static constexpr const char* unit = "J";
  static constexpr const char* meaning = "kinetic energy of the particles, translation and rotation";
  static constexpr Subject subject = Subject::particles;
  void add(const StatisticScene&, const ParticleValues& p, std::span<double> sums) const {
    sums[0] += 0.5 * p.mass * (dot(p.velocity, p.velocity) + 0.4 * p.radius * p.radius * dot(p.spin, p.spin));
  }
};

// h = mean y of the particles with y > above and z < depth (Goldschmidt 2004).
struct BedHeight {
  static constexpr const char* name = "bed_height";
  static constexpr const char* unit = "m";
  static constexpr const char* meaning = "mean height of the particles in the window";
  static constexpr Subject subject = Subject::particles;
  double above = 0;                                        // m
  double depth = std::numeric_limits<double>::infinity();  // m
  std::size_t sums(const StatisticScene&) const { return 2; }
  void add(const StatisticScene&, const ParticleValues& p, std::span<double> sums) const {
    if (p.position.y <= above || p.position.z >= depth) return;
    sums[0] += p.position.y;
    sums[1] += 1;
  }
  void finish(const StatisticScene&, std::span<const double> sums, std::span<double> value) const {
    value[0] = sums[0] / sums[1];  // 0/0 is NaN: nobody in the window
  }
};

struct ParticleCount {
  static constexpr const char* name = "particle_count";
  static constexpr const char* unit = "1";
  static constexpr const char* meaning = "number of particles";
  static constexpr Subject subject = Subject::particles;
  int type = -1;      // -1: of all
  double parcel = 1;  // particles that each computed one stands for
  void add(const StatisticScene&, const ParticleValues& p, std::span<double> sums) const {
    if (type < 0 || p.type == type) sums[0] += parcel;
  }
};

struct ParticleMass {
  static constexpr const char* name = "particle_mass";
  static constexpr const char* unit = "kg";
  static constexpr const char* meaning = "mass of the particles";
  static constexpr Subject subject = Subject::particles;
  int type = -1;  // -1: of all
  void add(const StatisticScene&, const ParticleValues& p, std::span<double> sums) const {
    if (type < 0 || p.type == type) sums[0] += p.mass;
  }
};

// P_d = Σ m V_d
struct ParticleMomentum {
  static constexpr const char* name = "particle_momentum";
  static constexpr const char* unit = "kg·m/s";
  static constexpr const char* meaning = "momentum of all particles in one direction";
  static constexpr Subject subject = Subject::particles;
  int axis = 1;
  void add(const StatisticScene&, const ParticleValues& p, std::span<double> sums) const { sums[0] += p.mass * p.velocity[axis]; }
};

// Mean velocity of the particles in top-hat bins across the width: a slab |y − height| ≤ half_height, depth_low ≤ z ≤ depth_high.
struct VelocityProfile {
  static constexpr const char* name = "particle_velocity";
  static constexpr const char* unit = "m/s";
  static constexpr const char* meaning = "mean velocity of the particles in bins across the width";
  static constexpr Subject subject = Subject::particles;
  double height = 0, half_height = 0.0005;                                     // m
  int bins = 1;                                                                // over the whole width
  int component = 1;                                                           // of the velocity
  double depth_low = 0, depth_high = std::numeric_limits<double>::infinity();  // m
  std::vector<double> places(const StatisticScene& s) const {
    std::vector<double> middles(bins);
    for (int b = 0; b < bins; ++b) middles[b] = (b + 0.5) * s.size.x / bins;
    return middles;
  }
  std::size_t sums(const StatisticScene&) const { return 2 * static_cast<std::size_t>(bins); }
  void add(const StatisticScene& s, const ParticleValues& p, std::span<double> sums) const {
    if (std::abs(p.position.y - height) > half_height || p.position.z < depth_low || p.position.z > depth_high) return;
    const int bin = std::clamp(static_cast<int>(p.position.x / s.size.x * bins), 0, bins - 1);
    sums[2 * bin] += p.velocity[component];
    sums[2 * bin + 1] += 1;
  }
  void finish(const StatisticScene&, std::span<const double> sums, std::span<double> value) const {
    for (int b = 0; b < bins; ++b) value[b] = sums[2 * b] / sums[2 * b + 1];  // NaN in an empty bin
  }
};

// Weight of a row of cells in a value at a height: linear between the rows' centres, the nearest row at the ends.
inline double row_weight(const StatisticScene& s, double height, int row) {
  const double rows_up = std::clamp(height / s.size.y * s.cells[1] - 0.5, 0.0, s.cells[1] - 1.0);
  return std::max(0.0, 1 - std::abs(rows_up - row));
}

// p(low) − p(high), each the mean of the pressure over the plane.
struct PressureDrop {
  static constexpr const char* name = "pressure_drop";
  static constexpr const char* unit = "Pa";
  static constexpr const char* meaning = "gas pressure at the lower height less that at the upper, averaged over each plane";
  static constexpr Subject subject = Subject::pressure;
  double low = 0, high = 0;  // m
  double weight(const StatisticScene& s, int row) const { return row_weight(s, low, row) - row_weight(s, high, row); }
  std::size_t slot(int /*column*/) const { return 0; }
  void finish(const StatisticScene& s, std::span<const double> sums, std::span<double> value) const {
    value[0] = sums[0] / (static_cast<double>(s.cells[0]) * s.cells[2]);
  }
};

// ε over x at a height, mean over the depth; one place a column of cells.
struct VoidFractionProfile {
  static constexpr const char* name = "void_fraction";
  static constexpr const char* unit = "1";
  static constexpr const char* meaning = "gas fraction across the width at the height, averaged over the depth";
  static constexpr Subject subject = Subject::fraction;
  double height = 0;  // m
  std::vector<double> places(const StatisticScene& s) const {
    std::vector<double> centres(s.cells[0]);
    for (int i = 0; i < s.cells[0]; ++i) centres[i] = (i + 0.5) * s.size.x / s.cells[0];
    return centres;
  }
  std::size_t sums(const StatisticScene& s) const { return s.cells[0]; }
  double weight(const StatisticScene& s, int row) const { return row_weight(s, height, row); }
  std::size_t slot(int column) const { return column; }
  void finish(const StatisticScene& s, std::span<const double> sums, std::span<double> value) const {
    for (std::size_t i = 0; i < sums.size(); ++i) value[i] = sums[i] / s.cells[2];
  }
};

// F_d = −Σ F_contact of the particles on the wall, the mean of the step.
struct WallForce {
  static constexpr const char* name = "wall_force";
  static constexpr const char* unit = "N";
  static constexpr const char* meaning = "force of the particles on the wall in one direction, the mean of the step";
  static constexpr Subject subject = Subject::walls;
  int wall = 0;  // of the faces of the box, 2·direction + side, and then of the walls
  int axis = 1;
  void add(Vec3 force, Vec3 /*torque*/, std::span<double> sums) const { sums[0] += force[axis]; }
};
// The same of the torque about the wall's axis of rotation, or the origin.
struct WallTorque {
  static constexpr const char* name = "wall_torque";
  static constexpr const char* unit = "N·m";
  static constexpr const char* meaning =
      "torque of the particles on the wall about its axis of rotation, or the origin, one component, the mean of the step";
  static constexpr Subject subject = Subject::walls;
  int wall = 0;
  int axis = 2;
  void add(Vec3 /*force*/, Vec3 torque, std::span<double> sums) const { sums[0] += torque[axis]; }
};

// The statistics of a step are told by the step; there is nothing to sum.
struct MassBalance {
  static constexpr const char* name = "mass_balance";
  static constexpr const char* unit = "1";
  static constexpr const char* meaning = "gas that entered less gas that left less storage, over what entered, in a step";
  static constexpr Subject subject = Subject::step;
  double value(const StepValues& step) const { return step.mass_residual; }
};
struct MomentumBalance {
  static constexpr const char* name = "momentum_balance";
  static constexpr const char* unit = "1";
  static constexpr const char* meaning =
      "what the gas lost to the particles less what they received, over the sum of both, in a step";
  static constexpr Subject subject = Subject::step;
  double value(const StepValues& step) const { return step.momentum_residual; }
};
struct MassEntered {
  static constexpr const char* name = "mass_entered";
  static constexpr const char* unit = "kg";
  static constexpr const char* meaning = "mass of the particles that have entered since time 0";
  static constexpr Subject subject = Subject::step;
  double value(const StepValues& step) const { return step.mass_entered; }
};
struct MassLeft {
  static constexpr const char* name = "mass_left";
  static constexpr const char* unit = "kg";
  static constexpr const char* meaning = "mass of the particles that have left since time 0";
  static constexpr Subject subject = Subject::step;
  double value(const StepValues& step) const { return step.mass_left; }
};
// A mean over time is that of each step's largest.
struct MaxOverlap {
  static constexpr const char* name = "max_overlap";
  static constexpr const char* unit = "1";
  static constexpr const char* meaning = "largest overlap of a contact over the diameter, since the value before";
  static constexpr bool peak = true;  // a sample is the largest value since the sample before, not that of its own step
  static constexpr Subject subject = Subject::step;
  double value(const StepValues& step) const { return step.max_overlap; }
};

using Statistic = std::variant<KineticEnergy, BedHeight, PressureDrop, MassBalance, MomentumBalance, MaxOverlap, ParticleCount,
                               VoidFractionProfile, VelocityProfile, ParticleMomentum, ParticleMass, MassEntered, MassLeft,
                               WallForce, WallTorque>;

// What a statistic leaves out when it is a series of one sum.
template <class Law>
constexpr bool has_places = requires(const Law& law, const StatisticScene& scene) {
  law.places(scene);
};
template <class Law>
constexpr bool keeps_peak = requires {
  Law::peak;
};
template <class Law>
std::size_t sums_of(const Law& law, const StatisticScene& scene) {
  if constexpr (requires { law.sums(scene); }) return law.sums(scene);
  return Law::subject == Subject::step ? 0 : 1;
}
template <class Law>
std::vector<double> places_of(const Law& law, const StatisticScene& scene) {
  if constexpr (has_places<Law>) return law.places(scene);
  return {};
}
template <class Law>
void values_from(const Law& law, const StatisticScene& scene, std::span<const double> sums, std::span<double> values) {
  if constexpr (requires { law.finish(scene, sums, values); }) {
    law.finish(scene, sums, values);
  } else {
    values[0] = sums[0];
  }
}

}  // namespace bedflow
