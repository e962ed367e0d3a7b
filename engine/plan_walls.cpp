#include "plan_walls.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace bedflow {

namespace {

constexpr double most_move = 0.1;  // in a sub-step, in radii

// Whether the surface and the face have a flat piece in common: places just above the face then see the wall below them.
bool lies_on(const Surface& surface, int d, int side, Vec3 size) {
  constexpr int places = 16;
  constexpr double near = 1e-7;
  Touches touches;
  for (int i = 0; i < places; ++i)
    for (int j = 0; j < places; ++j) {
      Vec3 x;
      x[d] = (side == 0 ? near : 1 - near) * size[d];
      x[(d + 1) % 3] = (i + 0.5) / places * size[(d + 1) % 3];
      x[(d + 2) % 3] = (j + 0.5) / places * size[(d + 2) % 3];
      const double reach = 1.01 * near * size[d];
      touches.clear();
      std::visit([&](const auto& shape) { shape.touch(x, reach, touches); }, surface);
      if (touches.empty()) continue;
      const Touch nearest = touches.contacts()[0];
      if (std::abs(nearest.distance) < reach && std::abs(nearest.normal[d]) > 1 - 1e-12) return true;
    }
  return false;
}

Bounds bounds_of(const Surface& surface) {
  return std::visit([](const auto& shape) { return shape.bounds(); }, surface);
}

const char* motion_text(const Motion& motion) {
  constexpr const char* names[] = {"at rest", "translating", "rotating", "vibrating", "moving by a table"};
  return names[motion.index()];
}

class Check {
 public:
  Check(const Scene& scene, double skin, double substep)
      : scene_(scene), reach_(skin + scene.particles->laws.range()), substep_(substep) {
    double largest = 0;
    for (const ParticleType& type : scene.particles->types) {
      largest = std::max(largest, type.radius);
      smallest_ = std::min(smallest_, type.radius);
    }
    reach_ += largest;
  }

  // Why the wall is refused; empty: it is not.
  std::string operator()(const Wall& wall) const {
    const Bounds bounds = bounds_of(wall.surface);
    std::ostringstream why;
    for (int d = 0; d < 3; ++d) {
      const double low = bounds.low[d], high = bounds.high[d], size = scene_.size[d];
      const char axis = "xyz"[d];
      if (std::holds_alternative<Still>(wall.motion) && (high < -reach_ || low > size + reach_)) {
        why << "is beyond the box: from " << low << " to " << high << " m along " << axis << ", domain.size." << axis << " is "
            << size << " m";
        return why.str();
      }
      if (scene_.periodic[d] && !stays_clear(wall, d)) {
        why << "ends within the reach of the particles, " << reach_ << " m, of a periodic face (domain.periodic." << axis
            << "), where walls are not repeated: keep it clear of both faces, or let it go on beyond both by that much";
        return why.str();
      }
      for (int side = 0; side < 2; ++side)
        if (scene_.sides[d][side] == Side::wall && lies_on(wall.surface, d, side, scene_.size)) {
          why << "lies on the face " << axis << (side == 0 ? "_low" : "_high")
              << " of the box, which is a wall itself: particles would touch both; leave it out, or move it into the box";
          return why.str();
        }
    }
    return too_fast(wall, bounds);
  }

 private:
  bool stays_clear(const Wall& wall, int d) const {
    if (const Plane* plane = std::get_if<Plane>(&wall.surface)) return std::abs(plane->normal[d]) < 1e-12;
    const Bounds bounds = bounds_of(wall.surface);
    const bool within = bounds.low[d] >= reach_ && bounds.high[d] <= scene_.size[d] - reach_;
    return within || (bounds.low[d] <= -reach_ && bounds.high[d] >= scene_.size[d] + reach_);
  }

  std::string too_fast(const Wall& wall, Bounds bounds) const {
    for (int d = 0; d < 3; ++d) {
      bounds.low[d] = std::max(bounds.low[d], -reach_);
      bounds.high[d] = std::min(bounds.high[d], scene_.size[d] + reach_);
    }
    const double move = fastest_speed(wall.motion, bounds) * substep_, most = most_move * smallest_;
    if (move <= most) return "";
    std::ostringstream why;
    why << "moves " << move << " m in a sub-step of " << substep_ << " s, more than " << most_move
        << " of a particle's radius: slow it down, or raise particles.steps_per_collision";
    return why.str();
  }

  const Scene& scene_;
  double reach_, substep_;                                     // of the largest particle beyond its centre, m; s
  double smallest_ = std::numeric_limits<double>::infinity();  // radius of a type, m
};

// Whether a particle of a region can be seeded astride of the panel: its place is then on either side, or on both.
bool astride(const SeedRegion& region, const Panel& panel, double radius) {
  const auto reaches = [&](Vec3 low, Vec3 high) {
    for (int d = 0; d < 3; ++d) {
      const bool flat = panel.low[d] == panel.high[d];
      if (high[d] <= panel.low[d] + (flat ? 1e-9 : 0) * radius || low[d] >= panel.high[d] - (flat ? 1e-9 : 0) * radius)
        return false;
    }
    return true;
  };
  return std::visit(
      [&]<class Seeds>(const Seeds& seeds) {
        if constexpr (std::is_same_v<Seeds, PlacedSeeds>) {
          return std::any_of(seeds.begin(), seeds.end(), [&](const PlacedSphere& sphere) {
            const double r = sphere.diameter > 0 ? sphere.diameter / 2 : radius;
            return reaches(sphere.position - Vec3{r, r, r}, sphere.position + Vec3{r, r, r});
          });
        } else {
          return reaches(seeds.low, seeds.high);
        }
      },
      region.seeds);
}

void check_panels(const Scene& scene, std::ostringstream& all) {
  if (!scene.gas) return;
  const std::vector<Panel>& panels = scene.gas->setup.panels;
  for (const SeedRegion& region : scene.particles->regions)
    for (std::size_t p = 0; p < panels.size(); ++p)
      if (astride(region, panels[p], scene.particles->largest() / 2))
        all << "\n  domain.panels[" << p << "] crosses the seeds of " << region.path
            << ": particles would stand astride of it; end the region at the panel, and put another behind it";
}

}  // namespace

std::string walls_text(const std::vector<Wall>& walls) {
  std::ostringstream text;
  for (const Wall& wall : walls) {
    if (&wall != &walls.front()) text << ", ";
    text << wall.name << " (";
    if (const Mesh* mesh = std::get_if<Mesh>(&wall.surface)) text << mesh->facets().size() << " facets, ";
    text << motion_text(wall.motion) << ")";
  }
  return text.str();
}

void check_walls(const Scene& scene, double skin, double substep) {
  std::ostringstream all;
  for (std::size_t w = 0; w < scene.walls.size(); ++w) {
    const std::string why = Check(scene, skin, substep)(scene.walls[w]);
    if (!why.empty()) all << "\n  walls[" << w << "], " << scene.walls[w].name << ", " << why;
  }
  check_panels(scene, all);
  if (!all.str().empty()) throw Stop(Reason::invalid_case, "walls that cannot be:" + all.str());
}

}  // namespace bedflow
