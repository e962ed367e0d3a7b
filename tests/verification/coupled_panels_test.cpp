// Rectangles inside a bed: gas passes a plate against its resistance, nothing passes a baffle, no particle passes either.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/scene.h"

namespace bedflow {
namespace {

constexpr double plate_height = 0.006, resistance = 50;  // m, Pa·s/m

// A bed on a distributor plate, two cells above the inflow.
std::string on_a_plate(const std::string& coupling) {
  std::string text = with(small_bed("spring { friction: 0.3 }"), "y: 14", "y: 12");
  text = with(text, "low {} high { x: 0.015 y: 0.018", "low { y: 0.006 } high { x: 0.015 y: 0.024");
  text = with(text, "faces {", "panels { low { y: 0.006 } high { x: 0.015 y: 0.006 z: 0.01 } plate { linear: 50 } } faces {");
  return with(text, "hat {} explicit {}", coupling);
}

class Plates : public testing::TestWithParam<const char*> {};

TEST_P(Plates, CarryTheBedAndLetTheGasThrough) {
  const Comm world = Comm::world();
  const Plan plan = make_plan(scene_of(world, on_a_plate(GetParam())), world.size());
  PhaseTimer timer;
  Simulation simulation(plan, world, timer);
  simulation.seed();
  const double radius = 0.0006;
  for (int n = 0; n < 250; ++n) {
    simulation.step();
    ASSERT_FALSE(simulation.failure()) << simulation.failure().message;
    const ParticleStore& particles = simulation.particles()->particles();
    double lowest = 1;
    for (std::size_t p = 0; p < particles.owned; ++p) lowest = std::min(lowest, particles.position(p).y);
    ASSERT_GT(world.min(lowest), plate_height + 0.8 * radius) << n;  // a soft contact gives way a little
  }
  EXPECT_EQ(world.sum(static_cast<std::int64_t>(simulation.particles()->particles().owned)), 600);
  // What the gas loses in the two cells about the plate is what the plate takes and what particles take in the half cell above:
  // less than the bed's weight over its area.
  const Simulation::GasPlot plot = simulation.gas_plot();
  double below = 0, above = 0;
  std::size_t at = 0;
  for (int k = 0; k < simulation.grid()->cells[2]; ++k)
    for (int j = 0; j < simulation.grid()->cells[1]; ++j)
      for (int i = 0; i < simulation.grid()->cells[0]; ++i, ++at) {
        const int y = simulation.grid()->first[1] + j;
        if (y < 2) {
          EXPECT_EQ(plot.fraction[at], 1);
        }
        below += y == 1 ? plot.pressure[at] / 24 : 0;
        above += y == 2 ? plot.pressure[at] / 24 : 0;
      }
  const double weight = 600 * sphere_volume(0.0012) * 1000 * 9.81 / (0.015 * 0.01), drop = world.sum(below) - world.sum(above);
  EXPECT_GT(drop, resistance * 0.9);
  EXPECT_LT(drop, resistance * 0.9 + weight);
}
INSTANTIATE_TEST_SUITE_P(EveryExchange, Plates,
                         testing::Values("hat {} explicit {}", "garg {} sub_stepped {}", "square_dpvm {} semi_implicit {}"));

// From either side.
TEST(Baffles, ThrowParticlesBack) {
  const Comm world = Comm::world();
  std::string text = small_bed("spring { friction: 0.3 }");
  text = with(text, "faces {", "panels { low { x: 0.0075 } high { x: 0.0075 y: 0.036 z: 0.01 } baffle {} } faces {");
  text = with(text, "velocity: 0.9", "velocity: 0.1");
  const std::size_t from = text.find("random {"), to = text.find("spring {");
  text.replace(from, to - from,
               "placed { spheres { position { x: 0.005 y: 0.02 z: 0.005 } velocity { x: 1 } } spheres { position { x: 0.01 y: "
               "0.03 z: 0.005 } velocity { x: -1 } } } ");
  const Plan plan = make_plan(scene_of(world, text), world.size());
  PhaseTimer timer;
  Simulation simulation(plan, world, timer);
  simulation.seed();
  while (simulation.time() < 0.004) simulation.step();
  const ParticleStore& particles = simulation.particles()->particles();
  std::int64_t back = 0;
  for (std::size_t p = 0; p < particles.owned; ++p) {
    const bool left = particles.id[p] == 0;
    const double speed = particles.velocity(p).x * (left ? -1 : 1);
    EXPECT_LT(particles.position(p).x * (left ? 1 : -1), left ? 0.0069 : -0.0081);
    EXPECT_NEAR(speed, 0.9, 0.02);  // restitution, a little less by the drag of 2.5 ms
    ++back;
  }
  EXPECT_EQ(world.sum(back), 2);
}

TEST(Panels, DoNotStandAcrossAFreshBed) {
  const Comm world = Comm::world();
  const std::string text =
      with(on_a_plate("hat {} explicit {}"), "low { y: 0.006 } high { x: 0.015 y: 0.024", "low {} high { x: 0.015 y: 0.024");
  const Scene scene = scene_of(world, text);
  try {
    make_plan(scene, world.size());
    FAIL() << "a bed astride of a plate is planned";
  } catch (const Stop& stop) {
    EXPECT_NE(std::string(stop.what()).find("domain.panels[0] crosses the seeds of particles"), std::string::npos) << stop.what();
  }
}

}  // namespace
}  // namespace bedflow
