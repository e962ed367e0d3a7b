// Particles that enter and leave: conveyor and fall with closed forms, blocked inlets, ranks, resume; beds of several sizes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "support/scene.h"

namespace bedflow {
namespace {

// 10 × 2 × 2 cm; the two types of 1 mm and 0.8 to 1.6 mm. A face that is not named is a wall.
std::string tube(const std::string& faces, const std::string& gravity = "", const std::string& seeding = "empty {}") {
  return R"(name: "tube" domain { size { x: 0.1 y: 0.02 z: 0.02 } faces { )" + faces + R"( } } gravity { )" + gravity + R"( }
    particles { linear_spring_dashpot { stiffness: 200 restitution: 0.8 } coulomb { friction: 0.2 } symplectic_euler {} steps_per_collision: 12 skin: 0.0002
      types { name: "even" density: 1000 constant { diameter: 0.001 } share: 2 }
      types { name: "mixed" density: 2500 uniform { smallest: 0.0008 largest: 0.0016 } } )" +
         seeding + R"( } time { end: 1 })";
}
const std::string out = "outflow { particles: LEAVE }";
std::string inflow(const std::string& more) {
  return "no_slip_wall {} particle_inflows { seed: 3 " + more + " }";
}

struct Flow {
  Flow(const Comm& comm, const std::string& text)
      : plan(make_plan(scene_of(comm, text), comm.size())), simulation(plan, comm, timer) {}
  void until(double time) {
    while (simulation.time() < time) simulation.step();  // the account is audited in every step
    ASSERT_FALSE(simulation.failure()) << simulation.failure().message;
  }
  std::int64_t count() const { return simulation.particle_count(); }
  Plan plan;
  PhaseTimer timer;
  Simulation simulation;
};

// All fly at 1 m/s and never meet. A particle's centre enters at its radius, up to a step further, and leaves at 10 cm; it is
// taken out when the list is rebuilt, half a skin further at most.
TEST(Conveyor, CarriesRateTimesTheTimeThatTheWayTakes) {
  Flow run(Comm::world(), tube("x_low { " + inflow("number_rate: 4000 velocity { x: 1 }") + " } x_high { " + out + " }"));
  run.simulation.seed();
  run.until(0.08);
  EXPECT_EQ(run.simulation.turnover().entered.count, static_cast<std::int64_t>(4000 * run.simulation.time()));
  EXPECT_EQ(run.count(), run.simulation.turnover().entered.count);
  run.until(0.2);
  const Turnover& turnover = run.simulation.turnover();
  EXPECT_EQ(turnover.entered.count, static_cast<std::int64_t>(4000 * run.simulation.time()));
  EXPECT_EQ(turnover.entered.count - turnover.left.count, run.count());
  const double step = run.plan.step, shortest = 0.1 - 0.0008 - 2 * step,
               longest = 0.1 - 0.0004 + run.plan.skin / 2 + run.plan.substep;
  EXPECT_GE(run.count(), std::floor(4000 * shortest));
  EXPECT_LE(run.count(), std::ceil(4000 * longest));
  EXPECT_EQ(run.simulation.particles()->contact_count(), 0);
}

// v = 1 m/s at the top of 10 cm (the tube stands): t = (√(v² + 2 g h) − v)/g, and rate × t kg are on their way.
TEST(Fall, HoldsRateTimesTheTimeOfTheFall) {
  Flow run(Comm::world(),
           tube("x_low { " + inflow("mass_rate: 0.005 velocity { x: 1 }") + " } x_high { " + out + " }", "x: 9.81"));
  run.simulation.seed();
  run.until(0.2);
  const double fall = (std::sqrt(1 + 2 * 9.81 * 0.1) - 1) / 9.81;
  const Turnover& turnover = run.simulation.turnover();
  const double heaviest = 2500 * std::numbers::pi / 6 * std::pow(0.0016, 3);
  EXPECT_NEAR(turnover.entered.mass, 0.005 * run.simulation.time(), heaviest);
  // Entry at the radius and up to a step's way deeper, leaving up to half a skin and a sub-step late: 1.5 mm of the way.
  EXPECT_NEAR(turnover.entered.mass - turnover.left.mass, 0.005 * fall, 0.005 * 0.0015 + heaviest);
}

// The types enter by their shares of number, 2:1, and the sizes by their law.
TEST(Inlet, KeepsTheMixture) {
  Flow run(Comm::world(), tube("x_low { " + inflow("number_rate: 4000 velocity { x: 1 }") + " } x_high { " + out + " }"));
  run.simulation.seed();
  run.until(0.095);
  const std::vector<SizeMoments> sizes = run.simulation.size_moments();
  const auto n = static_cast<double>(run.count());
  EXPECT_NEAR(static_cast<double>(sizes[0].count) / n, 2.0 / 3, 4 * std::sqrt(2.0 / 9 / n));  // four standard errors
  EXPECT_NEAR(sizes[1].mean, 0.0012, 4 * 0.0008 / std::sqrt(12 * static_cast<double>(sizes[1].count)));
  EXPECT_GE(sizes[1].smallest, 0.0008);
  EXPECT_LE(sizes[1].largest, 0.0016);
  EXPECT_EQ(sizes[0].deviation, 0);
}

// Two streams meet head on, fall and leave through the bottom; what is too much waits.
const std::string crossing = "x_low { " + inflow("number_rate: 3000 velocity { x: 0.6 } until: 0.12") + " } x_high { " +
                             inflow("number_rate: 1500 velocity { x: -0.6 y: 0.1 }") + " } y_low { " + out + " }";

TEST(Inlet, OfStreamsThatCollideIsAccountedFor) {
  Flow run(Comm::world(), tube(crossing, "y: -9.81"));
  run.simulation.seed();
  run.until(0.11);
  EXPECT_EQ(run.simulation.turnover().entered.count,
            static_cast<std::int64_t>(3000 * run.simulation.time()) + static_cast<std::int64_t>(1500 * run.simulation.time()));
  EXPECT_GT(run.simulation.turnover().left.count, 100);
  EXPECT_GT(run.count(), 100);
}

// A closed bottle fills until nobody finds room: what is due waits, nothing overlaps, nothing is lost.
TEST(Inlet, ThatIsBlockedWaits) {
  Flow run(Comm::world(), with(tube("y_high { " + inflow("number_rate: 60000 velocity { y: -0.5 }") + " }", "y: -9.81"),
                               "x: 0.1 y: 0.02 z: 0.02", "x: 0.008 y: 0.02 z: 0.008"));
  run.simulation.seed();
  run.until(0.05);
  const auto entered = static_cast<double>(run.simulation.turnover().entered.count);
  const double due = run.simulation.insertion()->mass_due(run.simulation.time());
  const double mean = (2.0 / 3 * 1000 * 1e-9 + 1.0 / 3 * 2500 * (std::pow(1.6e-3, 4) - std::pow(0.8e-3, 4)) / (4 * 0.8e-3)) *
                      std::numbers::pi / 6;
  EXPECT_GT(run.simulation.insertion()->states()[0].blocked, 0);
  EXPECT_LT(entered, 0.9 * 60000 * 0.05);
  EXPECT_NEAR(due / mean + entered, 60000 * run.simulation.time(), 1e-6 * 60000);
  EXPECT_EQ(run.count(), run.simulation.turnover().entered.count);
  EXPECT_LT(run.simulation.observation().max_overlap, 0.1);  // 0.8 m/s stopped by the spring: v √(m/k) is 0.08 of the largest
}

// Everything that a state is made of, in the order of the checkpoint.
std::vector<double> state_of(const Simulation& simulation) {
  const CheckpointContent content = simulation.checkpoint();
  std::vector<double> state{static_cast<double>(content.step), content.time};
  for (const auto& [name, value] : content.numbers) state.push_back(value);
  for (const CheckpointArray& array : content.arrays) {
    if (const auto* reals = std::get_if<std::vector<double>>(&array.values))
      state.insert(state.end(), reals->begin(), reals->end());
    if (const auto* ids = std::get_if<std::vector<std::int64_t>>(&array.values))
      state.insert(state.end(), ids->begin(), ids->end());
  }
  return state;
}

class Inflow : public testing::TestWithParam<std::string> {};

// Also of a particle that has made no step yet.
TEST_P(Inflow, ResumesBitForBit) {
  const Comm world = Comm::world();
  const TestFolder folder(world);
  const std::string text = with(tube(crossing, "y: -9.81"), "symplectic_euler", GetParam());
  Flow through(world, text);
  through.simulation.seed();
  through.until(0.06);
  const std::int64_t there = through.simulation.turnover().entered.count;
  while (through.simulation.turnover().entered.count == there) through.simulation.step();
  const CheckpointInfo info = write_checkpoint(world, folder.path(), through.simulation.checkpoint(), 2);
  through.until(0.1);
  Flow resumed(world, text);
  resumed.simulation.restore(CheckpointReader(world, info.path));
  resumed.until(0.1);
  const std::vector<double> a = state_of(through.simulation), b = state_of(resumed.simulation);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(double)), 0);
  resumed.simulation.step();
  EXPECT_NE(state_of(resumed.simulation), b);  // the comparison can fail
}
INSTANTIATE_TEST_SUITE_P(ByEachIntegrator, Inflow, testing::Values("symplectic_euler", "velocity_verlet"));

// What enters is decided from counters, so it does not depend on the ranks; until streams meet the paths do not either.
TEST(Inlet, IsTheSameOnAnyNumberOfRanks) {
  const Comm world = Comm::world(), self = Comm::self();
  Flow together(world, tube(crossing, "y: -9.81")), alone(self, tube(crossing, "y: -9.81"));
  for (Flow* run : {&together, &alone}) {
    run->simulation.seed();
    run->until(0.1);
  }
  EXPECT_EQ(together.simulation.turnover().entered.count, alone.simulation.turnover().entered.count);
  EXPECT_EQ(together.simulation.turnover().entered.mass, alone.simulation.turnover().entered.mass);
  // Chaos after collisions moves single particles by a step or so through the bottom.
  EXPECT_NEAR(static_cast<double>(together.count()), static_cast<double>(alone.count()), 5);
}

TEST(Inlet, GoesOnOnAnotherNumberOfRanks) {
  const Comm world = Comm::world(), self = Comm::self();
  const TestFolder folder(world);
  Flow together(world, tube(crossing, "y: -9.81")), alone(self, tube(crossing, "y: -9.81"));
  together.simulation.seed();
  together.until(0.05);
  const CheckpointInfo info = write_checkpoint(world, folder.path(), together.simulation.checkpoint(), 2);
  alone.simulation.restore(CheckpointReader(self, info.path));
  EXPECT_EQ(alone.count(), together.count());
  EXPECT_EQ(alone.simulation.turnover().entered.count, together.simulation.turnover().entered.count);
  alone.until(0.1);
  together.until(0.1);
  EXPECT_EQ(alone.simulation.turnover().entered.count, together.simulation.turnover().entered.count);
}

TEST(Outflow, WhoLeavesWhereNobodyMayIsNamedWithPlace) {
  const Comm world = Comm::world();
  const std::string one = "placed { spheres { position { x: 0.09 y: 0.01 z: 0.01 } velocity { x: 1 } } }";
  Flow run(world, tube("x_high { outflow {} }", "", one));
  run.simulation.seed();
  while (!run.simulation.particles()->stopped() && run.simulation.time() < 0.05) run.simulation.step();
  ASSERT_TRUE(run.simulation.particles()->stopped());
  const Failure failure = run.simulation.failure();
  if (!failure) return;  // another rank has it
  EXPECT_EQ(failure.reason, Reason::particle_lost);
  for (const char* part : {"particle 0 left through the open face x_high", "at (0.1", "LEAVE"})
    EXPECT_NE(failure.message.find(part), std::string::npos) << failure.message;
}

// ---------------------------------------------------------------------------------------------------- beds of several sizes

// The floor carries the weight: Σ k δ over the contacts with it, mean over 50 ms of a bed at rest but for 1 mm/s, is the weight
// plus the rate of the momentum. Without friction, so that the walls carry none. 200 samples of what still oscillates: 1e-3.
TEST(Bed, OfTwoTypesStandsOnTheFloorWithItsWeight) {
  const Comm world = Comm::world();
  const std::string bed =
      "composed { regions { random { solids_fraction: 0.15 seed: 4 region { low {} high { x: 0.02 y: 0.01 z: 0.02 } } } } }";
  const std::string damped = with(with(tube("", "y: -9.81", bed), "restitution: 0.8", "restitution: 0.3"), "x: 0.1", "x: 0.02");
  Flow run(world, with(damped, "coulomb { friction: 0.2 }", "frictionless {}"));
  run.simulation.seed();
  run.until(0.2);
  const Dem& dem = *run.simulation.particles();
  const auto momentum = [&] {
    double sum = 0;
    for (std::size_t i = 0; i < dem.particles().owned; ++i)
      sum += mass_of(dem.setup().types, dem.particles(), i) * dem.particles().velocity(i).y;
    return world.sum(sum);
  };
  const double begin = run.simulation.time(), before = momentum();
  double impulse = 0;
  while (run.simulation.time() < begin + 0.05) {
    run.simulation.step();
    for (std::size_t i = 0; i < dem.particles().owned; ++i)
      impulse += run.simulation.last_step() * 200 *
                 std::max(0.0, radius_of(dem.setup().types, dem.particles(), i) - dem.particles().position(i).y);
  }
  const double weight = 9.81 * run.simulation.turnover().initial.mass, time = run.simulation.time() - begin;
  EXPECT_NEAR((world.sum(impulse) - (momentum() - before)) / (weight * time), 1, 1e-3);
  EXPECT_LT(std::abs(momentum() - before) / (weight * time), 1e-2);
  EXPECT_EQ(run.simulation.size_moments().size(), 2u);
}

TEST(Bed, OfTwoTypesResumesBitForBit) {
  const Comm world = Comm::world();
  const TestFolder folder(world);
  const std::string text =
      with(tube("", "y: -9.81", "random { count: 800 seed: 4 velocity_deviation: 0.3 }"), "coulomb {", "spring {");
  Flow through(world, text), resumed(world, text);
  through.simulation.seed();
  through.until(0.02);
  const CheckpointInfo info = write_checkpoint(world, folder.path(), through.simulation.checkpoint(), 2);
  resumed.simulation.restore(CheckpointReader(world, info.path));
  through.until(0.04);
  resumed.until(0.04);
  const std::vector<double> a = state_of(through.simulation), b = state_of(resumed.simulation);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(double)), 0);
}

TEST(Turnover, DoesNotBalanceWhenAParticleOrItsMassIsMissing) {
  const Turnover turnover{{10, 1}, {5, 0.5}, {3, 0.3}};
  EXPECT_TRUE(turnover.balances({12, 1.2}));
  EXPECT_FALSE(turnover.balances({11, 1.2}));
  EXPECT_FALSE(turnover.balances({12, 1.2 + 1e-12}));
}

}  // namespace
}  // namespace bedflow
