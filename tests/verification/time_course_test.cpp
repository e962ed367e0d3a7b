// The whole engine in time: steps that end on corners, grow and shrink; driven flow; the same bits after a resume.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "support/scene.h"

namespace bedflow {
namespace {

// A jet that opens and closes into a box of gas.
std::string jet(const std::string& time) {
  return R"(name: "jet" domain { size { x: 0.04 y: 0.06 z: 0.02 } cells { x: 8 y: 12 z: 4 }
    faces { y_low { mass_inflow { mass_flow: 4e-4 rectangle { low { x: 0.015 } high { x: 0.025 z: 0.02 } }
        schedule { time: 0 share: 0 } schedule { time: 3.3e-3 share: 1 } schedule { time: 0.0101 share: 0.2 } } }
      y_high { outflow {} } } }
    gravity {} gas { density: 1.2 viscosity: 1.8e-5 simple {} smart {} } )" +
         time;
}

TEST(Course, StepsEndOnItsCornersAndBringItsMass) {
  const Comm world = Comm::world();
  PhaseTimer timer;
  Simulation simulation(make_plan(scene_of(world, jet("time { end: 0.02 step: 1e-3 }")), world.size()), world, timer);
  simulation.seed();
  std::vector<double> ends;
  double mass = 0, before = 0;
  while (!simulation.finished()) {
    simulation.step();
    ends.push_back(simulation.time());
    // Trapezium: exact for what is linear from corner to corner.
    const double now = 1.2 * simulation.gas_balance().in;
    mass += 0.5 * (before + now) * simulation.last_step();
    before = now;
  }
  for (const double corner : {3.3e-3, 0.0101, 0.02}) EXPECT_EQ(std::count(ends.begin(), ends.end(), corner), 1) << corner;
  const double exact = 4e-4 * (0.5 * 3.3e-3 + 0.6 * (0.0101 - 3.3e-3) + 0.2 * (0.02 - 0.0101));
  EXPECT_NEAR(mass / exact, 1, 2e-3);  // what the jet draws in beside it through the outflow
}

// The jet's 1.7 m/s and the cells of 5 mm: a Courant number of 1 is 3 ms.
TEST(AdaptiveStep, GrowsAndIsCutByTheCourantNumberAndSaysSo) {
  const Comm world = Comm::world();
  PhaseTimer timer;
  const auto run = [&](const std::string& time, int steps) {
    Simulation simulation(make_plan(scene_of(world, jet(time)), world.size()), world, timer);
    simulation.seed();
    std::string notes;
    for (int n = 0; n < steps; ++n) {
      simulation.step();
      for (const std::string& note : simulation.take_notes()) notes += note + "\n";
    }
    return std::pair{simulation.step_size(), notes};
  };
  const auto [grown, growth] = run("time { end: 1 step: 1e-5 longest_step: 1e-2 courant: 0.8 }", 300);
  EXPECT_NE(growth.find("dt grows to"), std::string::npos) << growth;
  EXPECT_GT(grown, 1e-4);
  EXPECT_LT(grown, 3e-3);
  const auto [held, cuts] = run("time { end: 1 step: 1e-3 courant: 0.2 }", 10);
  EXPECT_NE(cuts.find("Courant number must stay below time.courant = 0.2"), std::string::npos) << cuts;
  EXPECT_LT(held, 7e-4);
}

std::string driven_bed(const std::string& time) {
  return R"(name: "driven-bed" domain { size { x: 0.015 y: 0.036 z: 0.01 } cells { x: 6 y: 14 z: 4 } periodic { y: true z: true } }
    gravity { y: -9.81 }
    gas { density: 1.2 viscosity: 1.8e-5 simple {} superbee {}
      driving { y { mass_flux: 0.9 schedule { time: 0 share: 0.5 } schedule { time: 2e-3 share: 1 } } z { pressure_drop: 1 } } }
    particles { diameter: 0.0012 density: 1000 linear_spring_dashpot { stiffness: 440 restitution: 0.9 } symplectic_euler {}
      random { count: 900 seed: 3 velocity_deviation: 0.05 } spring { friction: 0.3 } }
    coupling { gidaspow_blended {} hat {} explicit {} }
    monitors { name: "exchange" momentum_balance {} interval: 0 } )" +
         time;
}

std::vector<double> state_of(const Simulation& simulation) {
  const CheckpointContent content = simulation.checkpoint();
  std::vector<double> values{content.time};
  for (const auto& [name, value] : content.numbers) values.push_back(value);
  for (const CheckpointArray& array : content.arrays)
    if (const auto* reals = std::get_if<std::vector<double>>(&array.values))
      values.insert(values.end(), reals->begin(), reals->end());
  return values;
}

TEST(DrivenBed, HoldsItsFluxAndGivesTheParticlesWhatTheGasLoses) {
  const Comm world = Comm::world();
  PhaseTimer timer;
  Simulation simulation(make_plan(scene_of(world, driven_bed("time { end: 1 }")), world.size()), world, timer);
  simulation.seed();
  for (int n = 0; n < 30; ++n) {
    simulation.step();
    EXPECT_LT(std::abs(simulation.observation().momentum_residual), 1e-12);  // round-off
  }
}

TEST(DrivenBed, ResumedIsTheUninterruptedRunBitForBit) {
  const Comm world = Comm::world();
  const Plan plan =
      make_plan(scene_of(world, driven_bed("time { end: 1 step: 2e-5 longest_step: 2e-4 courant: 0.5 }")), world.size());
  const TestFolder folder(world);
  PhaseTimer timer;
  Simulation through(plan, world, timer);
  through.seed();
  for (int n = 0; n < 27; ++n) through.step();
  EXPECT_GT(through.step_size(), 2e-5);
  const CheckpointInfo info = write_checkpoint(world, folder.path(), through.checkpoint(), 2);
  for (int n = 0; n < 60; ++n) through.step();
  Simulation resumed(plan, world, timer);
  resumed.restore(CheckpointReader(world, info.path));
  for (int n = 0; n < 60; ++n) resumed.step();
  const std::vector<double> a = state_of(through), b = state_of(resumed);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), 8 * a.size()), 0);
  resumed.step();
  EXPECT_NE(std::memcmp(a.data(), state_of(resumed).data(), 8 * a.size()), 0);  // the comparison can fail
}

TEST(DrivenBed, StepGrowsUntilTheDragForbidsIt) {
  const Comm world = Comm::world();
  PhaseTimer timer;
  Simulation simulation(make_plan(scene_of(world, with(driven_bed("time { end: 1 step: 1e-4 longest_step: 1 }"),
                                                       "gidaspow_blended {}", "constant_drag { coefficient: 2e-3 }")),
                                  world.size()),
                        world, timer);
  simulation.seed();
  std::string notes;
  for (int n = 0; n < 200; ++n) {
    simulation.step();
    for (const std::string& note : simulation.take_notes()) notes += note + "\n";
  }
  const double mass = 1000 * 3.14159265358979 / 6 * 0.0012 * 0.0012 * 0.0012;
  EXPECT_LE(simulation.step_size(), mass / 2e-3);
  EXPECT_GT(simulation.step_size(), 0.85 * mass / 2e-3);  // within a growth of it
}

}  // namespace
}  // namespace bedflow
