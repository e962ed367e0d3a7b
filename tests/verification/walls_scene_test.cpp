// Walls from the text of a case to the run: what is built of it, what the plan refuses, resume, monitors.
#include <gtest/gtest.h>

#include <cstring>

#include "support/scene.h"

namespace bedflow {
namespace {

// 40 beads fall on a floor that shakes, within a drum that turns, on a mesh that moves by a table.
std::string shaken(const std::string& walls) {
  return R"(name: "shaken" domain { size { x: 0.02 y: 0.02 z: 0.01 } cells { x: 8 y: 8 z: 4 } } gravity { y: -50 }
    particles { diameter: 0.0012 density: 1000 linear_spring_dashpot { stiffness: 440 restitution: 0.8 } spring { friction: 0.4 }
      symplectic_euler {} random { count: 40 seed: 3 region { low { x: 0.006 y: 0.007 } high { x: 0.014 y: 0.015 z: 0.01 } } } }
    time { end: 1 } )" +
         walls;
}
const std::string moving = R"(
  walls { name: "drum" cylinder { from { x: 0.01 y: 0.01 z: -0.01 } to { x: 0.01 y: 0.01 z: 0.02 } radius: 0.0095 closed: true
            particles: INSIDE } rotating { point { x: 0.01 y: 0.01 } axis { z: 2 } rate: 20 } friction: 0.9 restitution: 0.5 }
  walls { name: "floor" plane { point { y: 0.004 } normal { y: 3 } } cut_cells: true
            vibrating { amplitude { y: 1e-4 } frequency: 60 phase: 0.2 } }
  walls { name: "tray" mesh { open_sheet: true scale: 0.001 translation { y: 0.006 }
            triangles { a { x: 4 z: -1 } b { x: 8 z: -1 } c { x: 8 z: 11 } } triangles { a { x: 4 z: -1 } b { x: 8 z: 11 } c { x: 4 z: 11 } } }
          table { knots { time: 0 displacement {} } knots { time: 0.02 displacement { x: 0.004 } } } }
  monitors { name: "push" wall_force { wall: "floor" } interval: 0 }
  monitors { name: "twist" wall_torque { wall: "drum" } interval: 0 })";

Plan plan_of(const std::string& walls) {
  const Comm world = Comm::world();
  return make_plan(scene_of(world, shaken(walls)), world.size());
}

TEST(WallScene, EveryArmOfTheSchemaIsBuilt) {
  const std::vector<Wall> walls = plan_of(moving + R"(
    walls { name: "block" box { low { x: 0.001 y: 0.001 z: 0.001 } high { x: 0.002 y: 0.002 z: 0.002 } particles: OUTSIDE }
            translating { velocity { x: 0.01 } } }
    walls { name: "cone" cone { from { x: 0.01 y: 0.001 z: 0.005 } to { x: 0.01 y: 0.003 z: 0.005 } radius_from: 0 radius_to: 0.003 } }
    walls { name: "lid" profile { origin { x: 0.01 y: 0.018 z: 0.005 } axis { y: 1 } corners { radius: 0 height: 0 }
            corners { radius: 0.004 height: 0.001 } } })")
                                      .scene.walls;
  ASSERT_EQ(walls.size(), 6U);
  EXPECT_TRUE(std::get<Revolved>(walls[0].surface).closed());
  EXPECT_EQ(std::get<Rotation>(walls[0].motion).axis, (Vec3{0, 0, 1}));
  EXPECT_EQ(std::get<Rotation>(walls[0].motion).rate, 20);
  EXPECT_EQ(std::get<Mesh>(walls[1].surface).facets().size(), 2U * 8 * 4);  // one polygon a cell of the layer
  EXPECT_EQ(std::get<Vibration>(walls[1].motion).phase, 0.2);
  EXPECT_NEAR(norm(std::get<Mesh>(walls[2].surface).bounds().low - Vec3{0.004, 0.006, -0.001}), 0, 1e-15);
  EXPECT_NEAR(walls[2].pose(0.01).shift.x, 0.002, 1e-15);
  EXPECT_EQ(std::get<Box>(walls[3].surface).keep, Keep::outside);
  EXPECT_EQ(std::get<Translation>(walls[3].motion).velocity, (Vec3{0.01, 0, 0}));
  EXPECT_FALSE(std::get<Revolved>(walls[4].surface).closed());
  EXPECT_NEAR(std::get<Revolved>(walls[5].surface).bounds().high.y, 0.019, 1e-15);
}

TEST(WallScene, AWallHasItsOwnContactLaw) {
  const ContactLaws laws = plan_of(moving).scene.particles->laws;
  const auto& friction = std::get<LawTable<TangentialSpring>>(laws.tangential).walls;
  ASSERT_EQ(friction.size(), 4U);
  EXPECT_EQ(friction[0].friction, 0.4);  // the box
  EXPECT_EQ(friction[1].friction, 0.9);
  EXPECT_EQ(friction[2].friction, 0.4);
  const auto& contact = std::get<LawTable<LinearSpringDashpot>>(laws.contact).walls;
  EXPECT_NEAR(contact[0].damping_share, damping_share(0.8), 1e-15);
  EXPECT_NEAR(contact[1].damping_share, damping_share(0.5), 1e-15);
}

void expect_refused(const std::string& walls, const std::string& text, const std::string& periodic = "") {
  try {
    std::string text_of_case = shaken(walls);
    if (!periodic.empty()) text_of_case = with(text_of_case, "} gravity", periodic + " } gravity");
    make_plan(scene_of(Comm::world(), text_of_case), 1);
    ADD_FAILURE() << "not refused: " << walls;
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::invalid_case);
    EXPECT_NE(std::string(stop.what()).find(text), std::string::npos) << stop.what();
  }
}

TEST(WallPlan, RefusesByNameWhatCannotBe) {
  const std::string plane = R"(walls { name: "w" plane { point { y: %s } normal { y: 1 } } %m })";
  const auto at = [&](const std::string& y, const std::string& motion = "") { return with(with(plane, "%s", y), "%m", motion); };
  expect_refused(at("0"), "walls[0], w, lies on the face y_low of the box");
  expect_refused("walls { name: \"b\" box { low { x: 0.02 } high { x: 0.03 y: 0.01 z: 0.01 } } }", "b, lies on the face x_high");
  expect_refused(at("0.01", "vibrating { amplitude { y: 0.01 } frequency: 1000 }"), "w, moves 0.000317");
  expect_refused(at("0.01", "vibrating { amplitude { y: 0.01 } frequency: 1000 }"), "raise particles.steps_per_collision");
  expect_refused("walls { name: \"b\" box { low { x: 0.03 } high { x: 0.04 y: 0.01 z: 0.01 } } }",
                 "b, is beyond the box: from 0.03 to 0.04 m along x");
  const std::string tube =
      "walls { name: \"t\" cylinder { from { x: 0.01 y: 0.01 z: 0 } to { x: 0.01 y: 0.01 z: 0.01 } radius: 0.005 } }";
  EXPECT_NO_THROW(plan_of(tube));
  expect_refused(tube, "t, ends within the reach of the particles", "periodic { z: true }");
}

// Bit for bit, with walls in the midst of their motions, memories on them, and the monitors' values.
TEST(WallRun, ResumedIsTheUninterruptedRun) {
  const Comm world = Comm::world();
  const Plan plan = plan_of(moving);
  const TestFolder folder(world);
  PhaseTimer timer;
  Simulation through(plan, world, timer);
  through.seed();
  for (int s = 0; s < 160; ++s) through.step();
  const CheckpointInfo info = write_checkpoint(world, folder.path(), through.checkpoint(), 2);
  Simulation resumed(plan, world, timer);
  resumed.restore(CheckpointReader(world, info.path));
  double load = 0;
  for (int s = 0; s < 60; ++s) {
    through.step();
    resumed.step();
    const Observation seen = through.observation(), again = resumed.observation();
    for (std::size_t w = 0; w < seen.wall_loads.size(); ++w) {
      EXPECT_EQ(seen.wall_loads[w].force, again.wall_loads[w].force) << w;
      EXPECT_EQ(seen.wall_loads[w].torque, again.wall_loads[w].torque) << w;
      if (w >= 6) load += norm(seen.wall_loads[w].force);
    }
  }
  ASSERT_FALSE(through.failure()) << through.failure().message;
  const ParticleStore &a = through.particles()->particles(), &b = resumed.particles()->particles();
  ASSERT_EQ(a.owned, b.owned);
  EXPECT_EQ(std::memcmp(a.rows.data(), b.rows.data(), a.owned * sizeof(ParticleRow)), 0);
  EXPECT_GT(world.sum(load), 0);
}

// The monitors tell the sum over the ranks.
TEST(WallRun, MonitorsTellWhatTheWallsReceive) {
  const Comm world = Comm::world();
  const Plan plan = plan_of(moving);
  PhaseTimer timer;
  Simulation simulation(plan, world, timer);
  simulation.seed();
  std::vector<double> last(2);
  std::size_t samples = 0;
  Monitors monitors({plan.scene.size, plan.cells}, plan.scene.monitors,
                    {[&](const SampleOut& sample) {
                       last[sample.monitor] = sample.value;
                       ++samples;
                     },
                     {}});
  monitors.observe(simulation.observation(), 0, 0, 0);
  EXPECT_EQ(samples, 0U);  // nothing is known before the first step
  for (int s = 0; s < 160; ++s) {
    simulation.step();
    monitors.observe(simulation.observation(), simulation.steps(), simulation.time(), simulation.last_step());
  }
  EXPECT_EQ(samples, 320U);
  const Observation now = simulation.observation();
  EXPECT_LT(last[0], 0);
  EXPECT_NEAR(last[0], world.sum(now.wall_loads[7].force.y), 1e-15);
  EXPECT_NEAR(last[1], world.sum(now.wall_loads[6].torque.z), 1e-18);
}

}  // namespace
}  // namespace bedflow
