// A box of equal spheres for tests: Dem with all that it stands on, and its particles gathered by id.
#pragma once

#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <vector>

#include "particles/dem.h"
#include "support/seeds.h"

namespace bedflow {

// Müller's spheres in a box without gravity.
struct Spheres {
  double diameter = 1.2e-3, density = 1000, stiffness = 440, restitution = 0.97, friction = 0.1;
  Vec3 gravity{};
  double skin = 0.3e-3;
  std::array<Side, 3> sides{Side::wall, Side::wall, Side::wall};
  std::vector<Wall> walls{};

  ParticleType type() const { return {diameter / 2, density, false}; }
  double mass() const { return type().mass(); }
  LinearSpringDashpot contact() const { return LinearSpringDashpot::from_restitution(stiffness, restitution); }
  double collision_time() const { return contact().collision_time(mass() / 2); }
  template <class Law>
  Law law() const {
    if constexpr (std::is_same_v<Law, Coulomb>) return {friction};
    if constexpr (std::is_same_v<Law, TangentialSpring>) return TangentialSpring::from_normal(friction, contact());
    if constexpr (std::is_same_v<Law, Frictionless>) return {};
  }
  // The same between particles and on walls.
  template <class Law>
  LawTable<Law> everywhere(const Law& law) const {
    return {{law}, std::vector<Law>(1 + walls.size(), law)};
  }
  template <class Law>
  ContactLaws laws() const {
    ContactLaws result;
    result.contact = everywhere(contact());
    result.tangential = everywhere(law<Law>());
    return result;
  }
};

struct Particle {
  Vec3 position, velocity, spin;
};

template <class Law>
class Scene {
 public:
  Scene(const Comm& comm, Vec3 size, const Spheres& spheres, Int3 cells = {8, 8, 8}, bool gas = false, int tall = -1)
      : spheres_(spheres),
        decomposition_(
            comm, cells, size,
            {spheres.sides[0] == Side::periodic, spheres.sides[1] == Side::periodic, spheres.sides[2] == Side::periodic}, tall),
        dem(decomposition_, setup(spheres, gas), spheres.template laws<Law>(), timer, spheres.walls) {}

  void place(const std::vector<PlacedSphere>& spheres) { take(seed_placed(decomposition_, spheres)); }
  void seed(const RandomSeeds& seeds) { take(seed_random(decomposition_, spheres_.diameter / 2, seeds)); }
  void advance(int substeps, double dt, std::optional<double> time = {}) { dem.advance(substeps, dt, time); }
  const Decomposition& decomposition() const { return decomposition_; }

  // All particles of all ranks by id, on every rank; places as the owners have them.
  std::map<std::int64_t, Particle> gathered() const {
    std::vector<double> mine;
    const ParticleStore& p = dem.particles();
    for (std::size_t i = 0; i < p.owned; ++i) {
      mine.push_back(static_cast<double>(p.id[i]));
      for (const Vec3 v : {p.position(i), p.velocity(i), p.spin(i)}) mine.insert(mine.end(), {v.x, v.y, v.z});
    }
    const std::vector<double> all = decomposition_.comm().gather_all(mine);
    std::map<std::int64_t, Particle> result;
    for (auto row = all.begin(); row != all.end(); row += 10)
      result[static_cast<std::int64_t>(row[0])] = {{row[1], row[2], row[3]}, {row[4], row[5], row[6]}, {row[7], row[8], row[9]}};
    return result;
  }

 private:
  static DemSetup setup(const Spheres& spheres, bool gas) {
    DemSetup result;
    result.types = {spheres.type()};
    result.gravity = spheres.gravity;
    result.skin = spheres.skin;
    result.gas = gas ? GasForce::frozen : GasForce::none;
    for (int d = 0; d < 3; ++d) result.sides[d] = {spheres.sides[d], spheres.sides[d]};
    return result;
  }
  void take(ParticleStore store) { dem.set_particles(std::move(store)); }

  Spheres spheres_;
  Decomposition decomposition_;

 public:
  PhaseTimer timer;
  Dem dem;
};

// What a checkpoint holds of a rank's particles.
struct Saved {
  ParticleStore particles;
  std::vector<Vec3> places;
  std::vector<PairHistory> pairs;
  std::vector<WallHistory> walls;
  explicit Saved(const Dem& dem)
      : particles(dem.particles()),
        places(dem.positions_at_rebuild()),
        pairs(dem.pair_histories()),
        walls(dem.wall_histories()) {}
};

inline bool same_bits(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec3)) == 0);
}

}  // namespace bedflow
