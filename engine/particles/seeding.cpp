#include "particles/seeding.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "base/stop.h"
#include "particles/random.h"

namespace bedflow {

namespace {

constexpr int most_tries = 20000;  // for one sphere

// Spheres placed so far, in cells at least a diameter wide.
class Occupied {
 public:
  Occupied(Vec3 low, Vec3 high, double diameter, std::int64_t count) : low_(low), diameter_(diameter) {
    const Vec3 extent = high - low;
    double edge = diameter;
    const auto cells = [&](int d) { return std::floor(extent[d] / edge) + 1; };
    while (cells(0) * cells(1) * cells(2) > 64 + 8 * static_cast<double>(count)) edge *= 1.25;
    for (int d = 0; d < 3; ++d) cells_[d] = static_cast<int>(cells(d));
    edge_ = edge;
    head_.assign(static_cast<std::size_t>(cells_[0]) * cells_[1] * cells_[2], -1);
  }
  bool add_if_free(Vec3 x) {
    Int3 cell{};
    for (int d = 0; d < 3; ++d) cell[d] = std::min(static_cast<int>((x[d] - low_[d]) / edge_), cells_[d] - 1);
    for (int k = std::max(cell[2] - 1, 0); k <= std::min(cell[2] + 1, cells_[2] - 1); ++k)
      for (int j = std::max(cell[1] - 1, 0); j <= std::min(cell[1] + 1, cells_[1] - 1); ++j)
        for (int i = std::max(cell[0] - 1, 0); i <= std::min(cell[0] + 1, cells_[0] - 1); ++i)
          for (std::int64_t n = head_[index(i, j, k)]; n >= 0; n = next_[n])
            if (dot(x - centres_[n], x - centres_[n]) < diameter_ * diameter_) return false;
    std::int64_t& head = head_[index(cell[0], cell[1], cell[2])];
    next_.push_back(head);
    head = static_cast<std::int64_t>(centres_.size());
    centres_.push_back(x);
    return true;
  }
  const std::vector<Vec3>& centres() const { return centres_; }

 private:
  std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) + static_cast<std::size_t>(cells_[0]) * (j + static_cast<std::size_t>(cells_[1]) * k);
  }
  Vec3 low_;
  double diameter_, edge_ = 0;
  Int3 cells_{};
  std::vector<std::int64_t> head_, next_;
  std::vector<Vec3> centres_;
};

[[noreturn]] void refuse_region(const RandomSeeds& seeds, double radius, std::int64_t placed) {
  const Vec3 edges = seeds.high - seeds.low;
  const double solid = 4 * std::numbers::pi / 3 * radius * radius * radius * static_cast<double>(seeds.count);
  std::ostringstream message;
  message << "particles.random.region: " << seeds.count << " spheres of " << 2 * radius << " m do not fit at random into "
          << edges.x << " x " << edges.y << " x " << edges.z << " m; they are " << solid / (edges.x * edges.y * edges.z)
          << " of it, and random places without overlap are found to about 0.3 (" << placed
          << " found a place); enlarge the region, or lower particles.random.count";
  throw Stop(Reason::invalid_case, message.str());
}

void keep_if_owned(const Decomposition& decomposition, ParticleStore& store, std::int64_t id, const PlacedSphere& sphere) {
  if (decomposition.owner(sphere.position) != decomposition.comm().rank()) return;
  store.add(id, sphere.position, sphere.velocity, sphere.spin);
}

}  // namespace

ParticleStore seed_random(const Decomposition& decomposition, double radius, const RandomSeeds& seeds) {
  const Vec3 margin{radius, radius, radius}, low = seeds.low + margin, high = seeds.high - margin;
  for (int d = 0; d < 3; ++d)
    if (seeds.count > 0 && low[d] > high[d]) refuse_region(seeds, radius, 0);
  Random random(seeds.seed);
  Occupied occupied(low, high, 2 * radius, seeds.count);
  for (std::int64_t id = 0; id < seeds.count; ++id) {
    int tries = 0;
    while (!occupied.add_if_free(random.inside(low, high)))
      if (++tries == most_tries) refuse_region(seeds, radius, id);
  }
  ParticleStore store;
  for (std::int64_t id = 0; id < seeds.count; ++id) {
    Vec3 velocity;
    if (seeds.velocity_deviation > 0)
      for (int d = 0; d < 3; ++d) velocity[d] = seeds.velocity_deviation * random.gaussian();
    keep_if_owned(decomposition, store, id, {occupied.centres()[id], velocity, {}});
  }
  return store;
}

ParticleStore seed_lattice(const Decomposition& decomposition, double radius, Int3 count, Vec3 low, Vec3 high) {
  Vec3 spacing;
  for (int d = 0; d < 3; ++d) {
    spacing[d] = (high[d] - low[d]) / count[d];
    if (count[d] > 0 &&
        spacing[d] < 2 * radius * (1 - 1e-12)) {  // spheres that just touch are allowed: round-off of the division
      std::ostringstream message;
      message << "particles.lattice.count."
              << "xyz"[d] << ": " << count[d] << " particles in " << high[d] - low[d] << " m stand " << spacing[d]
              << " m apart, less than their diameter " << 2 * radius << " m; enlarge particles.lattice.region or lower the count";
      throw Stop(Reason::invalid_case, message.str());
    }
  }
  ParticleStore store;
  std::int64_t id = 0;
  for (int k = 0; k < count[2]; ++k)
    for (int j = 0; j < count[1]; ++j)
      for (int i = 0; i < count[0]; ++i)
        keep_if_owned(decomposition, store, id++,
                      {low + Vec3{(i + 0.5) * spacing.x, (j + 0.5) * spacing.y, (k + 0.5) * spacing.z}, {}, {}});
  return store;
}

ParticleStore seed_placed(const Decomposition& decomposition, const std::vector<PlacedSphere>& spheres) {
  ParticleStore store;
  for (std::size_t i = 0; i < spheres.size(); ++i) keep_if_owned(decomposition, store, static_cast<std::int64_t>(i), spheres[i]);
  return store;
}

}  // namespace bedflow
