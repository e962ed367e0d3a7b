// What is watched while a case runs: trouble is named by particle or cell, and gone back from if the case says so.
#include "guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "bedflow/v1/job.pb.h"
#include "record_log.h"
#include "run.h"
#include "support/scene.h"

namespace bedflow {
namespace {

using testing::HasSubstr;

// Two particles that run into each other along x at the speed given, m/s: τ = 0.205 ms, 20 sub-steps in it.
std::string impact(double speed, const std::string& guard, const std::string& more = "") {
  const std::string v = std::to_string(speed);
  return R"(name: "impact" domain { size { x: 0.02 y: 0.01 z: 0.01 } } gravity {}
    particles { diameter: 0.002 density: 1000 linear_spring_dashpot { stiffness: 500 restitution: 1 } frictionless {} symplectic_euler {}
      placed { spheres { position { x: 0.0085 y: 0.005 z: 0.005 } velocity { x: )" +
         v + R"( } } spheres { position { x: 0.0115 y: 0.005 z: 0.005 } velocity { x: -)" + v + R"( } } } }
    guard { )" +
         guard + " } time { end: 0.001 } " + more;
}

// Steps until the guard finds something; what it says.
std::string trouble(const Scene& scene, int steps) {
  const Comm world = Comm::world();
  PhaseTimer timer;
  Simulation simulation(make_plan(scene, world.size()), world, timer);
  simulation.seed();
  for (int s = 0; s < steps; ++s) {
    simulation.step();
    if (world.any(static_cast<bool>(simulation.failure()))) break;
  }
  EXPECT_TRUE(!simulation.failure() || simulation.failure().reason == Reason::diverged);
  return simulation.failure().message;
}

std::string trouble(const std::string& text, int steps) {
  return trouble(scene_of(Comm::world(), text), steps);
}

// On every rank that has seen it, and one has.
void expect_said(const std::string& said, const std::vector<std::string>& parts) {
  const Comm world = Comm::world();
  EXPECT_TRUE(world.any(!said.empty()));
  if (said.empty()) return;
  for (const std::string& part : parts) EXPECT_THAT(said, HasSubstr(part));
}

// The deepest overlap of an elastic head-on impact is v sqrt(m*/k) with the relative speed v: 0.0655 of the two radii at 2 m/s
// each.
TEST(Guard, NamesTheContactThatOverlapsTooMuch) {
  const double deepest = 4 * std::sqrt(1000 * std::numbers::pi / 6 * 8e-9 / 2 / 500) / 0.002;
  EXPECT_EQ(trouble(impact(2, "overlap: " + std::to_string(1.02 * deepest)), 6), "");
  expect_said(trouble(impact(2, "overlap: " + std::to_string(0.9 * deepest)), 6),
              {"a contact overlaps by " + std::to_string(deepest).substr(0, 4), "guard.overlap"});
}

TEST(Guard, NamesTheParticleThatMovesTooFarInASubStep) {
  const double substep = make_plan(scene_of(Comm::world(), impact(2, "")), 1).substep;
  const double move = 2 * substep / 0.002;
  EXPECT_EQ(trouble(impact(2, "move: " + std::to_string(1.01 * move)), 1), "");
  expect_said(trouble(impact(2, "move: " + std::to_string(0.99 * move)), 1), {"particle ", "guard.move", "steps_per_collision"});
}

std::string channel(const std::string& guard) {
  return R"(name: "channel" domain { size { x: 0.04 y: 0.04 z: 0.04 } cells { x: 8 y: 8 z: 8 }
    faces { y_low { inflow { velocity: 1 } } y_high { outflow {} } x_low { free_slip_wall {} } x_high { free_slip_wall {} }
      z_low { free_slip_wall {} } z_high { free_slip_wall {} } } } gravity {}
    gas { density: 1.2 viscosity: 1.8e-5 initial_velocity { y: 1 } simple {} upwind {} } time { end: 1 step: 1e-3 } guard { )" +
         guard + " }";
}

// Plug flow of 1 m/s through cells of 5 mm: 0.2 in a step of 1 ms.
TEST(Guard, NamesTheCellOfTheLargestCourantNumber) {
  EXPECT_EQ(trouble(channel("courant: 0.21"), 1), "");
  expect_said(trouble(channel("courant: 0.19"), 1), {"Courant number 0.2 ", "cell (", "guard.courant", "time.step"});
}

TEST(Guard, NamesTheCellThatParticlesFillTooMuch) {
  EXPECT_EQ(trouble(with(small_bed("frictionless {}"), "time {", "guard { gas_fraction: 0.2 } time {"), 1), "");
  expect_said(trouble(with(small_bed("frictionless {}"), "time {", "guard { gas_fraction: 0.8 } time {"), 1),
              {"the particles leave the gas 0.", "of cell (", "guard.gas_fraction"});
}

TEST(Guard, WhatIsNotANumberIsTrouble) {
  const Comm world = Comm::world();
  const Decomposition decomposition(world, {8, 4, 4}, {0.08, 0.04, 0.04}, {false, false, false});
  const Grid grid(decomposition);
  FaceField velocity(grid, 1);
  Failure failure;
  watch_gas({}, grid, velocity, 1e-3, failure);
  EXPECT_FALSE(failure);
  velocity[1](1, 2, 0) = std::nan("");
  watch_gas({}, grid, velocity, 1e-3, failure);
  EXPECT_EQ(failure.reason, Reason::diverged);
  EXPECT_THAT(failure.message, HasSubstr("nan in cell (" + std::to_string(grid.first[0] + 1) + ", "));
  Failure of_fraction;
  watch_fraction({}, grid, {std::nan(""), {0, 0, 0}}, of_fraction);
  EXPECT_EQ(of_fraction.reason, Reason::diverged);
}

// A cube of 6 × 6 × 6 elastic spheres between walls that press them by a hundredth of a diameter. Every row is a chain of
// springs: its fastest swing has ω = 2 √(k/m), symplectic Euler is stable up to dt = 2/ω, and τ = π √(m/2k): with fewer than π/√2
// = 2.22 sub-steps in τ it blows up.
Scene pressed(double steps_per_collision, double limit) {
  Scene scene = scene_of(Comm::world(), R"(name: "pressed" domain { size { x: 0.012 y: 0.012 z: 0.012 } } gravity { y: -9.81 }
    particles { diameter: 0.002 density: 1000 linear_spring_dashpot { stiffness: 500 restitution: 1 } frictionless {} symplectic_euler {}
      lattice { count { x: 6 y: 6 z: 6 } } } time { end: 10 } )");
  PlacedSeeds spheres;
  for (int i = 0; i < 216; ++i) {
    const int row = i / 6, layer = row / 6;
    const Vec3 place{i % 6 + 0.5, row % 6 + 0.5, layer + 0.5};
    spheres.push_back({.position = 0.99 * 0.002 * place, .diameter = 0.002});
  }
  scene.particles->regions[0].seeds = spheres;
  scene.size = 0.99 * scene.size;
  scene.particles->steps_per_collision = steps_per_collision;  // fewer than a case may ask for
  scene.substeps = 3;
  scene.guard.energy = limit;
  return scene;
}

TEST(Guard, NamesEnergyThatContactsCreateBeforeAllElse) {
  EXPECT_EQ(trouble(pressed(2.5, 0.05), 3000), "");
  expect_said(trouble(pressed(2, 0.2), 3000),
              {"contacts have created ", " J, ", "guard.energy is 0.2", "the fastest is particle ", "steps_per_collision"});
  EXPECT_THAT(trouble(pressed(2, 0), 3000), testing::Not(HasSubstr("guard.energy")));  // found later, by others
}

// A job folder of its own for a case, and what its event log warns of.
class Job {
 public:
  explicit Job(const std::string& text) {
    if (world_.root()) std::ofstream(folder_.path() / "case.txtpb") << text;
    world_.barrier();
  }
  Reason run() { return bedflow::run(world_, {folder_.path(), 0, std::nullopt}); }
  std::vector<std::string> warnings() const {
    std::vector<std::string> result;
    LogReader reader(folder_.path() / "events.log");
    EXPECT_TRUE(reader.read([&](const LogRecord& record) {
      v1::Event event;
      EXPECT_TRUE(event.ParseFromString(record.payload));
      if (event.log().severity() == v1::LogLine::WARNING) result.push_back(event.log().text());
    }));
    return result;
  }
  double halvings() const {
    return CheckpointReader(world_, list_checkpoints(folder_.path() / "checkpoints").front().path).number("guard/halvings");
  }

 private:
  Comm world_ = Comm::world();
  TestFolder folder_{world_};
};

// At 10 m/s a particle moves 0.051 of its diameter in a sub-step: twice halved that is below 0.02.
TEST(Guard, GoesBackWithHalfTheStepAsOftenAsTheCaseSays) {
  Job patient(impact(10, "overlap: 1 move: 0.02 retries: 2"));
  EXPECT_EQ(patient.run(), Reason::finished);
  const auto told = patient.warnings();
  ASSERT_EQ(told.size(), 2u);
  EXPECT_THAT(told[0], testing::AllOf(HasSubstr("guard.move"), HasSubstr("back to checkpoint_0000000000.h5"),
                                      HasSubstr("(1 of guard.retries = 2)")));
  EXPECT_THAT(told[1], HasSubstr("(2 of guard.retries = 2)"));
  EXPECT_EQ(patient.halvings(), 2);  // whoever resumes goes on with these steps

  Job impatient(impact(10, "overlap: 1 move: 0.02 retries: 1"));
  EXPECT_EQ(impatient.run(), Reason::diverged);
  EXPECT_EQ(impatient.warnings().size(), 1u);
  EXPECT_EQ(Job(impact(10, "overlap: 1 move: 0.02")).run(), Reason::diverged);
}

}  // namespace
}  // namespace bedflow
