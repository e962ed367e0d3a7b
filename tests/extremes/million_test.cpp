// A million particles with their gas: it holds, and the plan has told what it would need.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>

#include "support/scene.h"

namespace bedflow {
namespace {

// A lattice of 100 × 125 × 80 falls in the inflow of a bed that begins to move. Cells of two diameters.
constexpr const char* text = R"(name: "million"
  domain { size { x: 0.1 y: 0.25 z: 0.08 } cells { x: 50 y: 125 z: 40 } faces { y_low { inflow { velocity: 0.5 } } y_high { outflow {} } } }
  gravity { y: -9.81 } gas { density: 1.2 viscosity: 1.8e-5 projection {} smart {} }
  particles { diameter: 0.00099 density: 1000 linear_spring_dashpot { stiffness: 500 restitution: 0.9 } coulomb { friction: 0.1 }
    symplectic_euler {} lattice { count { x: 100 y: 125 z: 80 } region { low {} high { x: 0.1 y: 0.125 z: 0.08 } } } }
  coupling { gidaspow_blended {} hat {} explicit {} } time { end: 1 } monitors { name: "m" momentum_balance {} })";

TEST(Million, ParticlesStaySoundWithinTheMemoryThatThePlanTells) {
  const Comm self = Comm::self();
  PhaseTimer timer;
  const Plan plan = make_plan(scene_of(self, text), 1);
  ASSERT_EQ(plan.particle_count, 1000000);
  Simulation simulation(plan, self, timer);
  simulation.seed();
  for (int step = 0; step < 20; ++step) {
    simulation.step();
    ASSERT_FALSE(simulation.failure()) << simulation.failure().message;
  }
  EXPECT_EQ(simulation.particle_count(), 1000000);
  const Observation now = simulation.observation();
  EXPECT_LT(now.momentum_residual, 1e-10);  // round-off of sums over a million
  EXPECT_LT(now.mass_residual, 1e-6);       // what the projection leaves
  const ParticleStore& store = simulation.particles()->particles();
  double fastest = 0;
  for (std::size_t p = 0; p < store.owned; ++p) {
    ASSERT_TRUE(std::isfinite(norm(store.position(p)) + norm(store.velocity(p)) + norm(store.spin(p)))) << p;
    fastest = std::max(fastest, norm(store.velocity(p)));
  }
  EXPECT_LT(fastest, 1);  // m/s: twice the inflow, in 20 steps of 0.18 ms
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const double bytes = 1024 * static_cast<double>(used.ru_maxrss);
  EXPECT_LT(bytes, 1.3 * plan.memory_bytes);  // as the benches hold the plan to
}

}  // namespace
}  // namespace bedflow
