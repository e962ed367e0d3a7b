// The whole engine: resume, rank counts, scenes that lack a part.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <memory>

#include "balance.h"
#include "checkpoint/held_checkpoint.h"
#include "support/scene.h"

namespace bedflow {
namespace {

const std::string coulomb = "coulomb { friction: 0.3 }", spring = "spring { friction: 0.3 }", frictionless = "frictionless {}";

// Everything that a state is made of, bit by bit, in an order that does not know the ranks' storage.
struct State {
  std::vector<double> values;
  bool operator==(const State& other) const {
    return values.size() == other.values.size() && std::memcmp(values.data(), other.values.data(), values.size() * 8) == 0;
  }
};
State state_of(const Simulation& simulation) {
  const CheckpointContent content = simulation.checkpoint();
  State state{{static_cast<double>(content.step), content.time}};
  for (const auto& [name, value] : content.numbers) state.values.push_back(value);
  for (const CheckpointArray& array : content.arrays) {
    if (const auto* reals = std::get_if<std::vector<double>>(&array.values)) {
      state.values.insert(state.values.end(), reals->begin(), reals->end());
    } else if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&array.values)) {
      state.values.insert(state.values.end(), integers->begin(), integers->end());
    }
  }
  return state;
}

void run(Simulation& simulation, int steps) {
  for (int s = 0; s < steps; ++s) simulation.step();
  ASSERT_FALSE(simulation.failure()) << simulation.failure().message;
}

class Resume : public testing::TestWithParam<std::string> {};

// Same binary, case and ranks give the same bits, run through or stopped and resumed.
TEST_P(Resume, IsTheUninterruptedRunBitForBit) {
  const Comm world = Comm::world();
  const Plan plan = make_plan(scene_of(world, GetParam()), world.size());
  const TestFolder folder(world);
  PhaseTimer timer;
  Simulation through(plan, world, timer);
  through.seed();
  run(through, 40);
  const CheckpointInfo info = write_checkpoint(world, folder.path(), through.checkpoint(), 2);
  run(through, 60);

  Simulation resumed(plan, world, timer);
  resumed.restore(CheckpointReader(world, info.path));
  run(resumed, 60);
  EXPECT_TRUE(state_of(resumed) == state_of(through));
  // The comparison can fail: one more step is another state.
  run(resumed, 1);
  EXPECT_FALSE(state_of(resumed) == state_of(through));
}
INSTANTIATE_TEST_SUITE_P(EveryTangentialLaw, Resume,
                         testing::Values(small_bed(coulomb), small_bed(spring), small_bed(frictionless)));
INSTANTIATE_TEST_SUITE_P(ByProjection, Resume,
                         testing::Values(with(small_bed(spring), "simple {} upwind {}", "projection {} smart {}")));
INSTANTIATE_TEST_SUITE_P(ExchangesThatOwe, Resume,
                         testing::Values(with(small_bed(frictionless), "explicit", "semi_implicit"),
                                         with(small_bed(frictionless), "hat {} explicit", "gaussian {} sub_stepped")));

struct Found {
  std::vector<Vec3> position;  // by id
  double kinetic = 0, fraction = 0, pressure = 0;
  std::size_t contacts = 0;
};
Found found(const Simulation& simulation, const Comm& comm) {
  Found result;
  const ParticleStore& store = simulation.particles()->particles();
  std::vector<double> rows;
  for (std::size_t p = 0; p < store.owned; ++p) {
    rows.insert(rows.end(), {static_cast<double>(store.id[p]), store.position(p).x, store.position(p).y, store.position(p).z});
  }
  rows = comm.gather_all(rows);
  result.position.resize(rows.size() / 4);
  for (std::size_t r = 0; r < rows.size(); r += 4)
    result.position[static_cast<std::size_t>(rows[r])] = {rows[r + 1], rows[r + 2], rows[r + 3]};
  result.kinetic = comm.sum(simulation.particles()->kinetic_energy());
  result.contacts = static_cast<std::size_t>(comm.sum(simulation.particles()->contact_count()));
  const Simulation::GasPlot gas = simulation.gas_plot();
  for (const double value : gas.fraction) result.fraction += value;
  for (const double value : gas.pressure) result.pressure += value;
  result.fraction = comm.sum(result.fraction);
  result.pressure = comm.sum(result.pressure);
  return result;
}

// Other ranks sum in another order and stop the linear solvers elsewhere: SIMPLE's tolerance (1e-9 here) is what the fields may
// differ by, and a particle's path with it. 20 steps are too short for a collision to magnify that beyond 1e-6 diameters.
void expect_alike(const Found& a, const Found& b) {
  ASSERT_EQ(a.position.size(), b.position.size());
  double furthest = 0;
  for (std::size_t i = 0; i < a.position.size(); ++i) furthest = std::max(furthest, norm(a.position[i] - b.position[i]));
  EXPECT_LT(furthest, 1e-6 * 0.0012);
  EXPECT_NEAR(a.kinetic / b.kinetic, 1, 1e-6);
  EXPECT_NEAR(a.fraction / b.fraction, 1, 1e-9);
  EXPECT_NEAR(a.pressure / b.pressure, 1, 1e-5);
  EXPECT_EQ(a.contacts, b.contacts);
}
std::string tight_bed() {
  return with(small_bed(spring), "simple {}", "simple { tolerance: 1e-9 pressure_tolerance: 1e-6 max_iterations: 2000 }");
}

TEST(Ranks, AgreeWithOneRank) {
  const Comm world = Comm::world(), self = Comm::self();
  const std::string projection = "projection { momentum_tolerance: 1e-10 pressure_tolerance: 1e-10 }";
  for (const std::string& text : {tight_bed(), with(small_bed(spring), "simple {}", projection)}) {
    PhaseTimer timer;
    Simulation together(make_plan(scene_of(world, text), world.size()), world, timer);
    Simulation alone(make_plan(scene_of(world, text), 1), self, timer);
    for (Simulation* simulation : {&together, &alone}) {
      simulation->seed();
      run(*simulation, 20);
    }
    expect_alike(found(together, world), found(alone, self));
  }
}

TEST(Ranks, ACheckpointGoesOnOnAnotherNumberOfRanks) {
  const Comm world = Comm::world(), self = Comm::self();
  const std::string text = tight_bed();
  const TestFolder folder(world);
  PhaseTimer timer;
  Simulation together(make_plan(scene_of(world, text), world.size()), world, timer);
  together.seed();
  run(together, 20);
  const CheckpointInfo info = write_checkpoint(world, folder.path(), together.checkpoint(), 2);
  Simulation alone(make_plan(scene_of(world, text), 1), self, timer);
  alone.restore(CheckpointReader(self, info.path));
  const Found before = found(together, world), taken = found(alone, self);
  EXPECT_EQ(before.position, taken.position);  // the same particles at the same places
  run(together, 20);
  run(alone, 20);
  expect_alike(found(together, world), found(alone, self));
}

// A bed whose right third is empty.
std::string leaning_bed() {
  return with(with(tight_bed(), "count: 600", "count: 400"), "high { x: 0.015", "high { x: 0.01");
}

std::unique_ptr<Simulation> moved(const Simulation& from, const Plan& plan, const Comm& comm, PhaseTimer& timer,
                                  const Cuts& cuts) {
  const HeldCheckpoint held(comm, from.checkpoint());
  auto result = std::make_unique<Simulation>(plan, comm, timer, cuts);
  result->restore(held);
  return result;
}

// What all contacts between particles remember, by the ids.
std::map<std::pair<double, double>, std::array<double, 3>> memories(const Simulation& simulation, const Comm& comm) {
  std::vector<double> rows;
  for (const PairHistory& pair : simulation.particles()->pair_histories()) {
    const Vec3 xi = pair.memory.displacement;
    rows.insert(rows.end(), {static_cast<double>(pair.low), static_cast<double>(pair.high), xi.x, xi.y, xi.z});
  }
  rows = comm.gather_all(rows);
  std::map<std::pair<double, double>, std::array<double, 3>> result;
  for (std::size_t r = 0; r < rows.size(); r += 5) result[{rows[r], rows[r + 1]}] = {rows[r + 2], rows[r + 3], rows[r + 4]};
  return result;
}

// Particles of the fullest rank over the ranks' mean.
double fullest(const Simulation& simulation, const Comm& comm) {
  const auto owned = static_cast<std::int64_t>(simulation.particles()->particles().owned);
  return static_cast<double>(comm.max(owned) * comm.size()) / static_cast<double>(comm.sum(owned));
}

TEST(Blocks, MovedToWhereTheWorkIsLeaveTheStateAsItIs) {
  const Comm world = Comm::world();
  const Plan plan = make_plan(scene_of(world, leaning_bed()), world.size());
  PhaseTimer timer;
  Simulation stays(plan, world, timer);
  stays.seed();
  run(stays, 20);
  const auto cuts = better_cuts(stays.decomposition(), plan, stays.particles());
  ASSERT_EQ(cuts.has_value(), world.size() > 1);
  if (!cuts) return;
  EXPECT_TRUE(fit(*cuts, plan));
  const auto goes = moved(stays, plan, world, timer, *cuts);
  EXPECT_LT(fullest(*goes, world), 0.8 * fullest(stays, world));
  EXPECT_FALSE(better_cuts(goes->decomposition(), plan, goes->particles()));  // at rest there

  const Found before = found(stays, world), after = found(*goes, world);
  EXPECT_EQ(before.position, after.position);
  EXPECT_FALSE(memories(stays, world).empty());
  EXPECT_EQ(memories(*goes, world), memories(stays, world));
  EXPECT_NEAR(after.kinetic / before.kinetic, 1, 1e-14);
  EXPECT_NEAR(after.fraction / before.fraction, 1, 1e-14);  // summed in another order
  EXPECT_NEAR(after.pressure / before.pressure, 1, 1e-14);
  run(stays, 20);
  run(*goes, 20);
  expect_alike(found(stays, world), found(*goes, world));
}

TEST(Blocks, OfACheckpointAreTakenUpAndGiveTheSameBits) {
  const Comm world = Comm::world();
  const Plan plan = make_plan(scene_of(world, leaning_bed()), world.size());
  const TestFolder folder(world);
  PhaseTimer timer;
  Simulation begun(plan, world, timer);
  begun.seed();
  const auto cuts = better_cuts(begun.decomposition(), plan, begun.particles());
  const auto through = moved(begun, plan, world, timer, cuts.value_or(begun.decomposition().cuts()));
  run(*through, 10);
  const CheckpointReader reader(world, write_checkpoint(world, folder.path(), through->checkpoint(), 2).path);
  ASSERT_EQ(Simulation::blocks_of(reader, world), through->decomposition().cuts());
  Simulation resumed(plan, world, timer, *Simulation::blocks_of(reader, world));
  resumed.restore(reader);
  run(*through, 10);
  run(resumed, 10);
  EXPECT_TRUE(state_of(resumed) == state_of(*through));
}

TEST(Scene, OfGasAloneAndOfParticlesAloneRun) {
  const Comm world = Comm::world();
  PhaseTimer timer;
  Simulation gas(make_plan(scene_of(world, R"(name: "gas" domain { size { x: 0.04 y: 0.04 z: 0.04 } cells { x: 8 y: 8 z: 8 }
    faces { y_low { inflow { velocity: 1 } } y_high { outflow {} } } } gravity {} gas { density: 1.2 viscosity: 1.8e-5 simple {} upwind {} }
    time { end: 1 step: 1e-3 })"),
                           world.size()),
                 world, timer);
  gas.seed();
  run(gas, 5);
  EXPECT_EQ(gas.particles(), nullptr);
  EXPECT_LT(std::abs(gas.observation().mass_residual), 1e-3);

  Simulation dem(make_plan(scene_of(world, R"(name: "dem" domain { size { x: 0.04 y: 0.04 z: 0.04 } } gravity { y: -9.81 }
    particles { diameter: 0.002 density: 1000 linear_spring_dashpot { stiffness: 1000 restitution: 0.5 } frictionless {} symplectic_euler {}
    random { count: 500 seed: 1 } } time { end: 1 })"),
                           world.size()),
                 world, timer);
  dem.seed();
  run(dem, 5);
  EXPECT_EQ(dem.grid(), nullptr);
  EXPECT_EQ(dem.particle_count(), 500);
}

// A scene that couples but has no particles is that of the gas alone in the same blocks, to the bit.
TEST(Scene, OfABedWithoutParticlesIsThatOfItsGas) {
  const Comm world = Comm::world();
  const std::string box = R"(name: "none" domain { size { x: 0.02 y: 0.04 z: 0.02 } cells { x: 5 y: 10 z: 5 }
    faces { y_low { inflow { velocity: 1 ramp { duration: 0.02 } } } y_high { outflow {} } } } gravity { y: -9.81 }
    gas { density: 1.2 viscosity: 1.8e-5 simple {} smart {} } time { end: 1 step: 1e-3 } )";
  const std::string none = R"(particles { diameter: 0.002 density: 1000 linear_spring_dashpot { stiffness: 1000 restitution: 0.5 }
    frictionless {} symplectic_euler {} random { count: 0 seed: 1 } } coupling { gidaspow_blended {} hat {} explicit {} })";
  PhaseTimer timer;
  Simulation coupled(make_plan(scene_of(world, box + none), world.size()), world, timer);
  Simulation alone(make_plan(scene_of(world, box), world.size()), world, timer, coupled.decomposition().cuts());
  for (Simulation* simulation : {&alone, &coupled}) {
    simulation->seed();
    run(*simulation, 10);
  }
  const Simulation::GasPlot a = alone.gas_plot(), b = coupled.gas_plot();
  EXPECT_TRUE(a.pressure == b.pressure);  // too much to print
  EXPECT_TRUE(a.velocity == b.velocity);
  EXPECT_TRUE(a.fraction == b.fraction);
}

// The engine leaves the exchange out two steps after the last particle has left; a resume passes nothing twice more. Both come to
// the same bits, and the next particle is felt.
TEST(Scene, ThatTheLastParticleHasLeftIsThatOfItsGasUntilOneEnters) {
  const Comm world = Comm::world();
  const std::string text = R"(name: "one" domain { size { x: 0.02 y: 0.03 z: 0.02 } cells { x: 5 y: 8 z: 5 }
    faces { y_low { inflow { velocity: 0.5 } } y_high { outflow { particles: LEAVE } }
      x_low { no_slip_wall {} particle_inflows { number_rate: 100 velocity { x: 0.5 y: 1 } from: 0.03 } } } } gravity { y: -9.81 }
    gas { density: 1.2 viscosity: 1.8e-5 simple {} smart {} }
    particles { diameter: 0.002 density: 1000 linear_spring_dashpot { stiffness: 1000 restitution: 0.5 } frictionless {} symplectic_euler {}
      placed { spheres { position { x: 0.01 y: 0.024 z: 0.01 } velocity { y: 1 } } } }
    coupling { gidaspow_blended {} hat {} semi_implicit {} } time { end: 1 step: 1e-3 })";
  const Plan plan = make_plan(scene_of(world, text), world.size());
  PhaseTimer timer;
  Simulation through(plan, world, timer);
  through.seed();
  run(through, 1);
  const auto lowest = [&] {
    double least = 1;
    for (const double fraction : through.gas_plot().fraction) least = std::min(least, fraction);
    return -world.max(-least);
  };
  EXPECT_LT(lowest(), 1);
  while (through.particle_count() > 0 && through.time() < 0.02) run(through, 1);
  ASSERT_EQ(through.particle_count(), 0);
  run(through, 1);
  EXPECT_EQ(lowest(), 1);
  run(through, 4);
  const auto resumed = moved(through, plan, world, timer, through.decomposition().cuts());
  while (through.time() < 0.05) {
    run(through, 1);
    run(*resumed, 1);
    ASSERT_TRUE(state_of(*resumed) == state_of(through)) << through.time();
  }
  EXPECT_GT(through.particle_count(), 0);
  EXPECT_LT(lowest(), 1);
}

TEST(Scene, ACheckpointOfAnotherSceneIsRefusedByField) {
  const Comm world = Comm::world();
  const TestFolder folder(world);
  PhaseTimer timer;
  Simulation bed(make_plan(scene_of(world, small_bed(coulomb)), world.size()), world, timer);
  bed.seed();
  const CheckpointInfo info = write_checkpoint(world, folder.path(), bed.checkpoint(), 2);
  Simulation other(make_plan(scene_of(world, with(small_bed(coulomb), "y: 14", "y: 15")), world.size()), world, timer);
  try {
    other.restore(CheckpointReader(world, info.path));
    FAIL() << "it was accepted";
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::invalid_case);
    EXPECT_NE(std::string(stop.what()).find("domain.cells.y"), std::string::npos) << stop.what();
  }
}

}  // namespace
}  // namespace bedflow
