// Histories and states that survive: rebuilds of the list, migration, restarts, other numbers of ranks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "particles/migration.h"
#include "support/dem_scene.h"

namespace bedflow {
namespace {

template <class Law>
class Restart : public testing::Test {};
using Laws = testing::Types<Coulomb, TangentialSpring>;
TYPED_TEST_SUITE(Restart, Laws);

// A sheared, loaded crowd: pressed into a corner, periodic in z, particles and contacts on all ranks.
Spheres loaded() {
  Spheres spheres;
  spheres.gravity = {-60, -100, 20};
  spheres.friction = 0.5;
  spheres.restitution = 0.8;
  spheres.sides[2] = Side::periodic;
  return spheres;
}
const Vec3 edges{0.012, 0.012, 0.008};

template <class Law>
void start(Scene<Law>& scene) {
  scene.seed({240, 5, {0, 0, 0}, {edges.x, 0.01, edges.z}, 0.1});
}
constexpr int settle = 4000, more = 300;
double sub_step() {
  return loaded().collision_time() / 20;
}

double largest_difference(const std::map<std::int64_t, Particle>& a, const std::map<std::int64_t, Particle>& b, Vec3 period) {
  EXPECT_EQ(a.size(), b.size());
  double largest = 0;
  for (const auto& [id, p] : a) {
    Vec3 apart = p.position - b.at(id).position;
    apart.z -= period.z * std::round(apart.z / period.z);  // one may have been wrapped already
    largest = std::max(largest, norm(apart));
  }
  return largest;
}

// The same trajectory whether the list, and with it every history, is rebuilt hundreds of times or a few times.
TYPED_TEST(Restart, HistoriesSurviveRebuildsAndMigration) {
  Scene<TypeParam> scene(Comm::world(), edges, loaded());
  start(scene);
  scene.advance(settle, sub_step());
  const Saved saved(scene.dem);
  if (TypeParam::history) {
    EXPECT_GT(scene.decomposition().comm().sum(static_cast<std::int64_t>(saved.pairs.size())), 100);
    EXPECT_GT(scene.decomposition().comm().sum(static_cast<std::int64_t>(saved.walls.size())), 20);
  }
  std::array<std::map<std::int64_t, Particle>, 3> ends;
  std::array<std::int64_t, 3> rebuilds{};
  for (const int run : {0, 1, 2}) {  // large skin, tiny skin, histories thrown away
    Spheres spheres = loaded();
    spheres.gravity = {60, -100, 60};  // they slide the other way: much moves
    spheres.skin = run == 1 ? 1e-7 : 0.5e-3;
    Scene<TypeParam> again(Comm::world(), edges, spheres);
    if (run < 2) {
      again.dem.restore(saved.particles, {}, saved.pairs, saved.walls);
    } else {
      again.dem.restore(saved.particles, {}, {}, {});
    }
    again.advance(more, sub_step());
    ends[run] = again.gathered();
    rebuilds[run] = again.dem.rebuilds();
  }
  EXPECT_LT(rebuilds[0], 5);
  EXPECT_GT(rebuilds[1], 100);
  EXPECT_LT(largest_difference(ends[0], ends[1], edges), 1e-9 * loaded().diameter);  // round-off of sums in another order
  if (TypeParam::history) {
    EXPECT_GT(largest_difference(ends[0], ends[2], edges), 1e-6 * loaded().diameter);
  }
}

TYPED_TEST(Restart, TheSameRanksGoOnWithTheSameBits) {
  Scene<TypeParam> whole(Comm::world(), edges, loaded());
  start(whole);
  whole.advance(settle / 2, sub_step());
  const Saved saved(whole.dem);
  Scene<TypeParam> resumed(Comm::world(), edges, loaded());
  resumed.dem.restore(saved.particles, saved.places, saved.pairs, saved.walls);
  whole.advance(settle / 2, sub_step());
  resumed.advance(settle / 2, sub_step());
  const ParticleStore &a = whole.dem.particles(), &b = resumed.dem.particles();
  EXPECT_EQ(a.owned, b.owned);
  EXPECT_EQ(a.id, b.id);
  EXPECT_TRUE(same_bits(a.positions(), b.positions()));
  EXPECT_TRUE(same_bits(a.velocities(), b.velocities()));
  EXPECT_TRUE(same_bits(a.spins(), b.spins()));
  EXPECT_TRUE(same_bits(whole.dem.positions_at_rebuild(), resumed.dem.positions_at_rebuild()));
  EXPECT_GT(whole.dem.rebuilds(), 10);
}

// As a checkpoint of other ranks hands it over: an even share of the rows, wherever they belong.
TYPED_TEST(Restart, OtherRanksKeepAllParticlesAndContacts) {
  const Comm world = Comm::world();
  Scene<TypeParam> alone(Comm::self(), edges, loaded());
  start(alone);
  alone.advance(settle, sub_step());
  const Saved saved(alone.dem);
  const auto share = [&](const auto& rows) {
    std::remove_cvref_t<decltype(rows)> mine;
    for (std::size_t i = static_cast<std::size_t>(world.rank()); i < rows.size(); i += static_cast<std::size_t>(world.size()))
      mine.push_back(rows[i]);
    return mine;
  };
  ParticleStore mine;
  for (std::size_t i = static_cast<std::size_t>(world.rank()); i < saved.particles.owned;
       i += static_cast<std::size_t>(world.size()))
    mine.add(saved.particles.id[i], saved.particles.position(i), saved.particles.velocity(i), saved.particles.spin(i));
  Scene<TypeParam> spread(world, edges, loaded());
  spread.dem.restore(redistribute(spread.decomposition(), spread.dem.setup(), mine), {}, share(saved.pairs), share(saved.walls));
  const auto before = spread.gathered();
  EXPECT_EQ(before.size(), 240u);
  std::int64_t pairs = world.sum(static_cast<std::int64_t>(spread.dem.pair_histories().size()));
  EXPECT_EQ(pairs, static_cast<std::int64_t>(saved.pairs.size()));
  EXPECT_EQ(world.sum(static_cast<std::int64_t>(spread.dem.wall_histories().size())),
            static_cast<std::int64_t>(saved.walls.size()));
  alone.advance(more, sub_step());
  spread.advance(more, sub_step());
  EXPECT_EQ(world.sum(spread.dem.contact_count()), alone.dem.contact_count());
  EXPECT_LT(largest_difference(alone.gathered(), spread.gathered(), edges), 1e-9 * loaded().diameter);
}

// Sums run in another order on other ranks; contacts make such round-off grow, so only a short time agrees this closely.
TYPED_TEST(Restart, AnyNumberOfRanksGivesTheSameMotion) {
  Scene<TypeParam> alone(Comm::self(), edges, loaded()), spread(Comm::world(), edges, loaded());
  start(alone);
  start(spread);
  EXPECT_EQ(largest_difference(alone.gathered(), spread.gathered(), edges), 0);
  for (Scene<TypeParam>* scene : {&alone, &spread}) scene->advance(1000, sub_step());
  EXPECT_EQ(spread.gathered().size(), 240u);
  EXPECT_GT(spread.dem.rebuilds(), 0);
  EXPECT_LT(largest_difference(alone.gathered(), spread.gathered(), edges), 1e-9 * loaded().diameter);
}

TEST(ContactHistory, APairThatSeparatesForgets) {
  Spheres spheres;
  spheres.friction = 0.5;
  Scene<TangentialSpring> scene(Comm::self(), edges, spheres);
  const double gap = 0.9999 * spheres.diameter;
  scene.place({{{0.004, 0.004, 0.004}, {0, 0.1, 0}, {}}, {{0.004 + gap, 0.004, 0.004}, {}, {}}});
  scene.advance(3, sub_step());
  ASSERT_EQ(scene.dem.pair_histories().size(), 1u);
  EXPECT_EQ(scene.dem.pair_histories()[0].low, 0);
  EXPECT_GT(scene.dem.pair_histories()[0].memory.displacement.y, 0);  // as seen by the lower id
  scene.advance(40, sub_step());
  EXPECT_EQ(scene.dem.contact_count(), 0);
  EXPECT_TRUE(scene.dem.pair_histories().empty());
}

TEST(Redistribute, EveryParticleComesToItsOwnerWithItsRows) {
  const Comm world = Comm::world();
  const Decomposition decomposition(world, {8, 8, 8}, {1, 1, 1}, {false, false, false});
  ParticleStore mine;
  for (std::int64_t id = world.rank(); id < 300; id += world.size()) {
    const double x = 0.1 + 0.8 * static_cast<double>(id * 37 % 300) / 300,
                 y = 0.1 + 0.8 * static_cast<double>(id * 91 % 300) / 300;
    mine.add(id, {x, y, 0.5}, {static_cast<double>(id), 0, 0}, {});
    mine.gas_force.push_back({0, static_cast<double>(id), 0});
  }
  DemSetup setup;
  setup.types = {{1e-3, 1000, false}};
  setup.gas = GasForce::frozen;
  const ParticleStore here = redistribute(decomposition, setup, mine);
  EXPECT_EQ(world.sum(static_cast<std::int64_t>(here.owned)), 300);
  for (std::size_t i = 0; i < here.owned; ++i) {
    EXPECT_EQ(decomposition.owner(here.position(i)), world.rank());
    EXPECT_EQ(here.velocity(i).x, static_cast<double>(here.id[i]));
    EXPECT_EQ(here.gas_force[i].y, static_cast<double>(here.id[i]));
  }
}

}  // namespace
}  // namespace bedflow
