// Crowds in moving walls, on any number of ranks: restarts, migration, what the walls receive.
#include <gtest/gtest.h>

#include <cstring>

#include "particles/migration.h"
#include "support/dem_scene.h"
#include "support/shapes.h"

namespace bedflow {
namespace {

const Vec3 edges{0.02, 0.02, 0.008}, centre{0.01, 0.01, 0};

// A drum that turns, with a lifter of two triangles that turns with it, and a floor that shakes below its axis.
Spheres drum() {
  Spheres spheres;
  spheres.gravity = {0, -100, 0};  // presses them on the walls soon
  spheres.friction = 0.5;
  spheres.restitution = 0.7;
  const Rotation turns{centre, {0, 0, 1}, 20};
  spheres.walls = {{"drum", Revolved::cylinder({0.01, 0.01, -0.01}, {0.01, 0.01, 0.02}, 0.0095, true, Keep::inside), turns},
                   {"lifter", Mesh(tessellated({0.0005, 0.01, -0.001}, {0.003, 0, 0}, {0, 0, 0.01}, 1, 1)), turns},
                   {"floor", Plane{{0, 1, 0}, 0.004}, Vibration{{0, 2e-4, 0}, 60, 0.3}}};
  return spheres;
}
double sub_step() {
  return drum().collision_time() / 20;
}
void start(Scene<TangentialSpring>& scene) {
  scene.seed({150, 5, {0.005, 0.006, 0}, {0.015, 0.015, edges.z}, 0.1});
}

constexpr int first = 5000, more = 1000;

TEST(WallsRestart, TheSameRanksGoOnWithTheSameBits) {
  const double dt = sub_step();
  Scene<TangentialSpring> whole(Comm::world(), edges, drum()), resumed(Comm::world(), edges, drum());
  start(whole);
  whole.advance(first, dt, 0.0);
  const Saved saved(whole.dem);
  std::int64_t on_walls = 0;  // not on faces of the box
  for (const WallHistory& wall : saved.walls) on_walls += wall.wall >= 6;
  EXPECT_GT(whole.decomposition().comm().sum(on_walls), 10);
  resumed.dem.restore(saved.particles, saved.places, saved.pairs, saved.walls);
  whole.advance(more, dt, first * dt);
  resumed.advance(more, dt, first * dt);
  const ParticleStore &a = whole.dem.particles(), &b = resumed.dem.particles();
  EXPECT_FALSE(whole.dem.failure()) << whole.dem.failure().message;
  EXPECT_EQ(a.id, b.id);
  EXPECT_TRUE(same_bits(a.positions(), b.positions()));
  EXPECT_TRUE(same_bits(a.velocities(), b.velocities()));
  EXPECT_TRUE(same_bits(a.spins(), b.spins()));
}

double largest_difference(const std::map<std::int64_t, Particle>& a, const std::map<std::int64_t, Particle>& b) {
  EXPECT_EQ(a.size(), b.size());
  double largest = 0;
  for (const auto& [id, p] : a) largest = std::max(largest, norm(p.position - b.at(id).position));
  return largest;
}

// One state continued on one rank, on all, with lists made anew all the time, and without its memory.
TEST(WallsRestart, MemorySurvivesListsMigrationAndOtherRanks) {
  const double dt = sub_step();
  Scene<TangentialSpring> alone(Comm::self(), edges, drum());
  start(alone);
  alone.advance(first, dt, 0.0);
  const Saved saved(alone.dem);
  alone.advance(more, dt, first * dt);
  const auto exact = alone.gathered();

  const Comm world = Comm::world();
  const bool mine = world.root();  // hands all out
  for (const bool remembers : {true, false}) {
    Spheres spheres = drum();
    spheres.skin = 0.05e-3;
    Scene<TangentialSpring> spread(world, edges, spheres);
    const ParticleStore here = redistribute(spread.decomposition(), spread.dem.setup(), mine ? saved.particles : ParticleStore{});
    spread.dem.restore(here, {}, mine ? saved.pairs : std::vector<PairHistory>{},
                       mine && remembers ? saved.walls : std::vector<WallHistory>{});
    spread.advance(more, dt, first * dt);
    const double difference = largest_difference(spread.gathered(), exact);
    if (remembers) {
      EXPECT_LT(difference, 1e-7 * spheres.diameter);  // round-off of sums in another order, grown in collisions
      EXPECT_GT(spread.dem.rebuilds(), 2 * alone.dem.rebuilds() / 4);
    } else {
      EXPECT_GT(difference, 1e-4 * spheres.diameter);
    }
  }
}

// m ΔV summed over the particles is the weight's impulse less what walls and faces received.
TEST(WallsLoad, WhatTheParticlesLoseTheWallsReceive) {
  const double dt = sub_step();
  const Spheres spheres = drum();
  Scene<TangentialSpring> scene(Comm::world(), edges, spheres);
  start(scene);
  scene.advance(first, dt, 0.0);
  const auto momentum = [&] {
    Vec3 sum;
    for (const auto& [id, p] : scene.gathered()) sum += spheres.mass() * p.velocity;
    return sum;
  };
  scene.dem.take_wall_loads();
  const Vec3 before = momentum();
  scene.advance(more, dt, first * dt);
  Vec3 gained = momentum() - before;
  gained -= (150 * spheres.mass() * more * dt) * spheres.gravity;
  double size = 0;
  for (const WallLoad& load : scene.dem.take_wall_loads())
    for (int d = 0; d < 3; ++d) {
      const double impulse = more * dt * scene.decomposition().comm().sum(load.force[d]);
      gained[d] += impulse;
      size += std::abs(impulse);
    }
  EXPECT_GT(size, 1e-6);
  EXPECT_LT(norm(gained), 1e-12 * size);  // round-off of some thousand sums
}

}  // namespace
}  // namespace bedflow
