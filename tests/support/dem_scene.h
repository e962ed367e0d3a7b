// A box of equal spheres for tests: Dem with all that it stands on, and its particles gathered by id.
#pragma once

#include <cstring>
#include <map>
#include <vector>

#include "support/seeds.h"
#include "support/spheres.h"

namespace bedflow {

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
