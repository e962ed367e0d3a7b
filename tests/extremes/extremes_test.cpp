// Scenes at the ends of what a case may ask for. Each is refused before it starts, with the field; or runs and stays sound; or
// stops with a reason that says what to do. Which of the three is written down here, so a change is seen.
//
// Sound: all is finite, nothing is lost, the gas' mass balance is within SIMPLE's tolerance, what the gas loses the particles
// receive to round-off, and no particle is faster than ten times what drives it can make it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <sstream>

#include "run.h"
#include "support/scene.h"

namespace bedflow {
namespace {

// A bed of 300 particles at most, in units of their diameter: 12 × 30 × 8, cells of 2.
struct Bed {
  double diameter = 0.001, density = 1000;
  double gas_density = 1.2, viscosity = 1.8e-5, inflow = 0.5;
  double gravity = 9.81;
  double stiffness = 500, restitution = 0.9;
  std::string tangential = "spring { friction: 0.3 }";
  std::string integrator = "symplectic_euler {}";
  std::string coupling = "gidaspow_blended {} hat {} explicit {}";
  std::string cells = "x: 6 y: 15 z: 4";
  std::string faces = "y_low { inflow { velocity: INFLOW } } y_high { outflow { screen: true } }";
  std::string domain = {};  // more of it
  std::string seeds = {};   // random in the lower half if empty
  std::string time = "end: 1";
  std::string more = {};
  Vec3 size{12, 30, 8};  // diameters
};

std::string number(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return text.str();
}
std::string vector_text(Vec3 v) {
  return "x: " + number(v.x) + " y: " + number(v.y) + " z: " + number(v.z);
}

std::string text_of(const Bed& bed) {
  const Vec3 size = bed.diameter * bed.size;
  std::string faces = bed.faces;
  if (const auto at = faces.find("INFLOW"); at != std::string::npos) faces.replace(at, 6, number(bed.inflow));
  const std::string seeds = bed.seeds.empty() ? "random { count: 300 seed: 2 region { low {} high { " +
                                                    vector_text({size.x, size.y / 2, size.z}) + " } } }"
                                              : bed.seeds;
  return "name: \"extreme\" domain { size { " + vector_text(size) + " } cells { " + bed.cells + " } faces { " + faces + " } " +
         bed.domain + " } gravity { y: " + number(-bed.gravity) + " } gas { density: " + number(bed.gas_density) +
         " viscosity: " + number(bed.viscosity) + " simple {} upwind {} } particles { diameter: " + number(bed.diameter) +
         " density: " + number(bed.density) + " linear_spring_dashpot { stiffness: " + number(bed.stiffness) +
         " restitution: " + number(bed.restitution) + " } " + bed.tangential + " " + bed.integrator + " " + seeds +
         " } coupling { " + bed.coupling + " } time { " + bed.time + " } monitors { name: \"m\" momentum_balance {} } " +
         bed.more;
}

enum class End { runs, refused, stopped };
struct Extreme {
  std::string name;
  Bed bed;
  int steps = 300;
  End end = End::runs;
  std::string word = {};  // in the message of a refusal or a stop
};
std::ostream& operator<<(std::ostream& out, const Extreme& extreme) {
  return out << extreme.name;
}

bool finite(Vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void expect_sound(Simulation& simulation, std::int64_t particles, double fastest) {
  const Observation now = simulation.observation();
  EXPECT_LT(now.momentum_residual, 1e-11);  // round-off of sums over 300 particles, worst direction
  ASSERT_EQ(simulation.particle_count(), particles);
  const ParticleStore& store = simulation.particles()->particles();
  for (std::size_t p = 0; p < store.owned; ++p) {
    ASSERT_TRUE(finite(store.position(p)) && finite(store.velocity(p)) && finite(store.spin(p))) << p;
    ASSERT_LT(norm(store.velocity(p)), fastest) << p;
  }
  const Simulation::GasPlot gas = simulation.gas_plot();
  for (std::size_t c = 0; c < gas.pressure.size(); ++c)
    ASSERT_TRUE(std::isfinite(gas.pressure[c]) && finite(gas.velocity[c]) && gas.fraction[c] > 0 && gas.fraction[c] <= 1 + 1e-12)
        << c;
}

// What happens to the scene; `message` of a refusal or a stop.
End end_of(const Extreme& extreme, std::string& message) {
  const Comm self = Comm::self();
  const Bed& bed = extreme.bed;
  PhaseTimer timer;
  std::unique_ptr<Simulation> simulation;
  try {
    const Plan plan = make_plan(scene_of(self, text_of(bed)), 1);
    simulation = std::make_unique<Simulation>(plan, self, timer);
    simulation->seed();
  } catch (const Stop& stop) {
    message = stop.what();
    EXPECT_EQ(stop.reason, Reason::invalid_case) << message;
    return End::refused;
  }
  const std::int64_t particles = simulation->particle_count();
  // Through the gaps of a dense bed the gas is several times as fast as it comes in; and a fall through the whole box.
  const double fastest = 10 * (bed.inflow / 0.35 + std::sqrt(2 * bed.gravity * bed.diameter * bed.size.y) + 1e-3);
  try {
    for (int s = 0; s < extreme.steps; ++s) {
      simulation->step();
      if (simulation->failure()) {
        message = simulation->failure().message;
        return End::stopped;
      }
    }
  } catch (const Stop& stop) {
    message = stop.what();
    return End::stopped;
  }
  expect_sound(*simulation, particles, fastest);
  return End::runs;
}

class Extremes : public testing::TestWithParam<Extreme> {};

TEST_P(Extremes, AreRefusedOrStoppedByNameOrStaySound) {
  std::string message;
  const End end = end_of(GetParam(), message);
  if (!message.empty()) std::printf("  %s\n", message.c_str());
  EXPECT_EQ(static_cast<int>(end), static_cast<int>(GetParam().end)) << message;
  EXPECT_THAT(message, testing::HasSubstr(GetParam().word));
}

const std::string semi_implicit = "gidaspow_blended {} hat {} semi_implicit {}";

std::vector<Extreme> extremes() {
  return {
      {"DensityRatioOne", {.density = 1000, .gas_density = 1000, .viscosity = 1e-3, .inflow = 0.01}},
      {"DensityRatioOneHundredThousand", {.density = 20000, .gas_density = 0.2, .inflow = 3}},
      {"TenMicrometresExplicit", {.diameter = 1e-5, .inflow = 1e-3, .stiffness = 1}},
      {"TenMicrometresSemiImplicit", {.diameter = 1e-5, .inflow = 1e-3, .stiffness = 1, .coupling = semi_implicit}},
      {"TenCentimetres", {.diameter = 0.1, .inflow = 20, .stiffness = 1e6}},
      {"SoftSpring", {.stiffness = 1}},
      {"StiffSpring", {.stiffness = 1e7}},
      {"HardlyBouncing", {.restitution = 0.05}},
      {"Elastic", {.restitution = 1}},
      {"WithoutFriction", {.tangential = "coulomb { friction: 0 }"}},
      {"FrictionTwo", {.tangential = "spring { friction: 2 }"}},
      {"ThinGas", {.viscosity = 1e-7}},
      {"Syrup", {.viscosity = 1}, 1, End::refused, "coupling.explicit is unstable beyond 2m/b"},
      {"SyrupSemiImplicit", {.viscosity = 1, .coupling = semi_implicit}},
      {"NoInflow", {.inflow = 0}},
      {"InflowOfTwoHundred", {.inflow = 200}, 300, End::stopped, "guard.move"},
      {"InflowOfTwoHundredFineSteps", {.inflow = 200, .coupling = semi_implicit, .time = "end: 1 step: 1e-6"}},
      {"OneParticle", {.seeds = "placed { spheres { position { x: 0.006 y: 0.01 z: 0.004 } } }"}},
      {"NoParticle", {.seeds = "random { count: 0 seed: 1 }"}},
      {"FullBox", {.seeds = "lattice { count { x: 12 y: 30 z: 8 } }"}},
      {"WithoutGravity", {.gravity = 0}},
      {"GravityOfAThousand", {.gravity = 9810}, 300, End::stopped, "guard.overlap"},
      {"GravityOfAThousandStiff", {.gravity = 9810, .stiffness = 1e5}},
      {"OverlappingAtTheStart",
       {.seeds = R"(placed { spheres { position { x: 0.006 y: 0.01 z: 0.004 } }
        spheres { position { x: 0.006 y: 0.0106 z: 0.004 } } })"},
       300,
       End::stopped,
       "guard.overlap"},
      {"OneCellDeep", {.cells = "x: 6 y: 15 z: 1"}},
      {"OneCell", {.cells = "x: 1 y: 1 z: 1"}},
      {"AspectOneToFiftyGaussian",
       {.coupling = "gidaspow_blended {} gaussian {} explicit {}", .cells = "x: 1 y: 50 z: 1", .size = {12, 12, 12}}},
      {"AspectOneToFiftyDpvm",
       {.coupling = "gidaspow_blended {} square_dpvm { width: 1 } explicit {}", .cells = "x: 1 y: 50 z: 1", .size = {12, 12, 12}},
       1,
       End::refused,
       "domain.cells.y"},
      {"LargerThanCellsGaussian", {.coupling = "gidaspow_blended {} gaussian {} explicit {}", .cells = "x: 24 y: 60 z: 16"}, 20},
      {"LargerThanCellsWithTheHat", {.cells = "x: 24 y: 60 z: 16"}, 1, End::refused, "domain.cells"},
      {"OnFacesOfCellsAndCorners", {.seeds = R"(placed { spheres { position { x: 0.002 y: 0.004 z: 0.002 } }
        spheres { position { x: 0.0005 y: 0.0005 z: 0.0005 } } spheres { position { x: 0.0115 y: 0.0295 z: 0.0075 } }
        spheres { position { x: 0.006 y: 0.0005 z: 0.004 } } })"}},
      {"OneOnTheOther",
       {.seeds = R"(placed { spheres { position { x: 0.006 y: 0.01 z: 0.004 } }
        spheres { position { x: 0.006 y: 0.01 z: 0.004 } } })"},
       1,
       End::refused,
       "particles.placed.spheres[1].position"},
      {"Touching", {.seeds = R"(placed { spheres { position { x: 0.006 y: 0.01 z: 0.004 } }
        spheres { position { x: 0.006 y: 0.011 z: 0.004 } } })"}},
      {"ClosedBox", {.inflow = 0, .faces = ""}},
      {"AllPeriodic", {.inflow = 0, .gravity = 0, .faces = "", .domain = "periodic { x: true y: true z: true }"}},
      {"AGasStepATau", {.time = "end: 1"}},
      {"AGasStepATwentiethOfTau", {.time = "end: 1 step: 3.6e-6"}, 200},
      {"TwoHundredSubStepsAGasStep", {.stiffness = 5e4, .time = "end: 1 step: 7.2e-5"}},
      {"OneSubStepAGasStep", {.time = "end: 1 substeps: 1"}},
      {"TwoHundredSubStepsByTheirNumber", {.stiffness = 5e4, .time = "end: 1 substeps: 200"}},
      {"TwoHundredSubStepsSoft", {.time = "end: 1 substeps: 200"}, 100},
      {"TwoHundredSubStepsSemiImplicit", {.coupling = semi_implicit, .time = "end: 1 substeps: 200"}, 100},
      {"FractionAtItsFloor",
       {.coupling = "gidaspow_blended {} hat {} explicit {} gas_fraction_floor: 0.6",
        .seeds = "lattice { count { x: 12 y: 30 z: 8 } }"}},
      {"FractionBelowTheGuard",
       {.seeds = "lattice { count { x: 12 y: 30 z: 8 } }", .more = "guard { gas_fraction: 0.6 }"},
       1,
       End::stopped,
       "guard.gas_fraction"},
      {"Verlet", {.restitution = 1, .tangential = "spring { friction: 2 }", .integrator = "velocity_verlet {}"}},
  };
}
INSTANTIATE_TEST_SUITE_P(Of, Extremes, testing::ValuesIn(extremes()), [](const auto& scene) { return scene.param.name; });

// A run that the guard stops leaves the state before, from which another case or finer steps may go on.
TEST(Stopped, RunsLeaveTheirLastGoodCheckpoint) {
  const Comm self = Comm::self();
  const TestFolder folder(self);
  std::ofstream(folder.path() / "case.txtpb") << text_of({.inflow = 200});
  EXPECT_EQ(run(self, {folder.path(), 0, std::nullopt}), Reason::diverged);
  std::vector<std::string> faults;
  const std::optional<CheckpointInfo> last = newest_good_checkpoint(self, folder.path() / "checkpoints", faults);
  ASSERT_TRUE(last);
  EXPECT_TRUE(faults.empty());
  PhaseTimer timer;
  Simulation simulation(make_plan(read_scene(folder.path() / "case.txtpb"), 1), self, timer);
  simulation.restore(CheckpointReader(self, last->path));
  expect_sound(simulation, 300, 1);
}

// Implicit convection has no limit: a channel that is fed at one half of its floor stays bounded at every Courant number.
TEST(Limits, OfImplicitConvectionAreNone) {
  for (const char* solver : {"simple {} upwind {}", "projection {} smart {}"}) {
    for (const double courant : {0.5, 5.0, 50.0}) {
      const double speed = 1, cell = 0.005;
      const std::string text =
          R"(name: "jet" domain { size { x: 0.04 y: 0.08 z: 0.02 } cells { x: 8 y: 16 z: 4 } faces { y_high { outflow {} }
            y_low { inflow { velocity: 0 patches { low { x: 0 y: 0 } high { x: 0.02 y: 0.02 z: 0.02 } velocity: 1 } } } } } gravity {}
            gas { density: 1.2 viscosity: 1.8e-5 )" +
          std::string(solver) + " } guard { courant: 1e6 } time { end: 100 step: " + std::to_string(courant * cell / speed) +
          " }";
      const Comm self = Comm::self();
      PhaseTimer timer;
      Simulation simulation(make_plan(scene_of(self, text), 1), self, timer);
      simulation.seed();
      double fastest = 0;
      for (int step = 0; step < 40; ++step) {
        simulation.step();
        for (const Vec3 u : simulation.gas_plot().velocity) fastest = std::max(fastest, norm(u));
      }
      std::printf("  %-44s Courant number %-13.3g bounded by %.3f of the jet's speed\n", solver, courant, fastest / speed);
      EXPECT_FALSE(simulation.failure());
      EXPECT_LT(fastest, 1.5 * speed);
    }
  }
}

}  // namespace
}  // namespace bedflow
