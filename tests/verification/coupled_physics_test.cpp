// Gas and particles together against closed forms.
#include <gtest/gtest.h>

#include <numbers>

#include "support/scene.h"

namespace bedflow {
namespace {

double cube(double x) {
  return x * x * x;
}

// ---------------------------------------------------------------------------------------- one falling sphere

// Velocity after `time` of m dV/dt = m g (1 − ρg/ρ) − b(|V|) V from rest, by RK4 with steps too small to matter.
double fall_by_rk4(const DragScene& gas, double density, double gravity, double fraction, double time) {
  const double mass = density * std::numbers::pi / 6 * cube(gas.diameter);
  const auto slope = [&](double v) {
    return gravity * (1 - gas.density / density) - WenYu{}(gas, std::abs(v), fraction) * v / mass;
  };
  double v = 0;
  const int steps = 20000;
  for (int s = 0; s < steps; ++s) {
    const double dt = time / steps, k1 = slope(v), k2 = slope(v + dt / 2 * k1), k3 = slope(v + dt / 2 * k2),
                 k4 = slope(v + dt * k3);
    v += dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return v;
}

// Gas held at rest under its own weight: the drag and the buoyancy that the transfer gives, the motion that the particles make.
double fall_by_transfer(const DragScene& gas, double density, double gravity, double time, int steps) {
  const Decomposition decomposition(Comm::self(), {4, 80, 4}, {4, 80, 4}, {true, false, true});
  const Grid grid(decomposition, 2);
  PhaseTimer timer;
  Halo halo(decomposition, grid, timer);
  GasState state(grid);
  for (int k = -2; k < 6; ++k)
    for (int j = -2; j < 82; ++j)
      for (int i = -2; i < 6; ++i) state.pressure(i, j, k) = -gas.density * gravity * j;
  Exchange exchange(grid);
  const double volume = std::numbers::pi / 6 * cube(gas.diameter);
  Transfer transfer(decomposition, grid, halo, {.particle_volume = volume}, timer);
  DemSetup setup{.types = {{gas.diameter / 2, density, false}},
                 .gravity = {0, -gravity, 0},
                 .skin = 0.1 * gas.diameter,
                 .gas = GasForce::frozen};
  setup.sides[0] = setup.sides[2] = {Side::periodic, Side::periodic};
  Dem dem(decomposition, setup, {LawTable<LinearSpringDashpot>{{{1, 0}}, {{1, 0}}}, LawTable<Frictionless>{{{}}, {{}}}, {}, {}},
          timer);
  ParticleStore one;
  one.add(0, {1.3, 79, 2.2}, {}, {});
  dem.set_particles(std::move(one));
  for (int s = 0; s < steps; ++s) {
    transfer.deposit_volume(dem.particles(), state.fraction);
    transfer.find_drag(WenYu{}, gas, dem.particles(), state);
    transfer.deposit_drag(dem.particles(), {}, exchange);
    transfer.sample(state, dem.particles());
    dem.advance(200, time / steps / 200);
  }
  return -dem.particles().velocity(0).y;
}

TEST(Fall, FollowsTheEquationOfMotionFromStokesToNewtonToFirstOrderInDt) {
  for (const double diameter : {20e-6, 300e-6, 5e-3}) {  // terminal Re of about 0.03, 40, 6000
    const DragScene gas{1.2, 1.8e-5, diameter};
    const double time = std::min(2.0, 2000e3 * diameter * diameter / 18 / 1.8e-5 * 1.2e-3);  // about the relaxation time
    const double exact = fall_by_rk4(gas, 1500, 9.81, 1 - 0, time);
    const double coarse = fall_by_transfer(gas, 1500, 9.81, time, 100) / exact - 1;
    const double fine = fall_by_transfer(gas, 1500, 9.81, time, 200) / exact - 1;
    EXPECT_LT(std::abs(fine), 5e-3) << diameter;
    EXPECT_NEAR(std::log2(std::abs(coarse / fine)), 1, 0.15) << diameter << " " << coarse << " " << fine;  // first order
  }
}

// ---------------------------------------------------------------------------------------- a fixed bed

// Two spheres a cell and direction at the quarter points: the deposit is uniform, next to walls too, and so is the flow.
TEST(FixedBed, PressureDropIsErgunsExactly) {
  const double cell = 2.5e-3, diameter = 1.2e-3;
  for (const double superficial : {0.05, 0.3, 1.5}) {
    const Decomposition decomposition(Comm::self(), {3, 8, 3}, {3 * cell, 8 * cell, 3 * cell}, {false, false, false});
    const Grid grid(decomposition);
    PhaseTimer timer;
    Halo halo(decomposition, grid, timer);
    GasSetup setup{.density = 1.2, .viscosity = 1.8e-5, .gravity = {}, .tolerance = 1e-10, .pressure_tolerance = 1e-4};
    for (auto& side : setup.faces[0]) side = FreeSlip{};
    for (auto& side : setup.faces[2]) side = FreeSlip{};
    setup.faces[1] = {Inflow{{superficial, superficial, 0}, {}}, Outflow{0}};
    GasSolver solver(decomposition, grid, halo, setup, timer);
    GasState gas(grid);
    Exchange exchange(grid);
    // The stated diameter makes drag; the volume that is deposited gives ε = 0.5.
    const double fraction = 0.5, volume = (1 - fraction) * grid.cell_volume() / 8;
    Transfer transfer(decomposition, grid, halo, {.particle_volume = volume}, timer);
    ParticleStore bed;
    for (int k = 0; k < 6; ++k)
      for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 6; ++i) bed.add(0, {(i + 0.5) * cell / 2, (j + 0.5) * cell / 2, (k + 0.5) * cell / 2}, {}, {});
    solver.prepare(gas, 0);
    transfer.deposit_volume(bed, gas.fraction);
    for (int step = 0; step < 60; ++step) {  // b follows U with a lag of a step
      transfer.find_drag(Ergun{}, {1.2, 1.8e-5, diameter}, bed, gas);
      transfer.deposit_drag(bed, {}, exchange);
      ASSERT_TRUE(solver.advance(gas, &exchange, 0, 1e-2).converged);
    }
    // n b U/ε per length with n particles a volume; with n of the real spheres of this ε it is the Ergun equation.
    const double number = 8 / grid.cell_volume();
    const double slope =
        number * Ergun{}({1.2, 1.8e-5, diameter}, superficial / fraction, fraction) * superficial / fraction / fraction;
    for (int j = 1; j < 7; ++j) {
      // SIMPLE's residual of 1e-10 on momentum leaves a relative error of that size, times the 60 steps' approach to rest.
      EXPECT_NEAR((gas.pressure(1, j - 1, 1) - gas.pressure(1, j, 1)) / cell / slope, 1, 1e-8) << superficial << " " << j;
    }
    const double ergun = 150 * std::pow(1 - fraction, 2) / cube(fraction) * 1.8e-5 * superficial / (diameter * diameter) +
                         1.75 * (1 - fraction) / cube(fraction) * 1.2 * superficial * superficial / diameter;
    const double real_number = (1 - fraction) / (std::numbers::pi / 6 * cube(diameter));
    EXPECT_NEAR(slope * real_number / number / ergun, 1, 1e-12);
  }
}

// ---------------------------------------------------------------------------------------- displacement

// A closed box without inflow: through every plane as much gas goes down as solids go up.
TEST(Displacement, AMovingCloudDrivesTheGasThatItDisplaces) {
  const Decomposition decomposition(Comm::self(), {4, 12, 3}, {4, 12, 3}, {false, false, false});
  const Grid grid(decomposition);
  PhaseTimer timer;
  Halo halo(decomposition, grid, timer);
  GasSetup setup{.density = 1, .viscosity = 1e-3, .gravity = {}, .tolerance = 1e-9, .pressure_tolerance = 1e-4};
  for (auto& pair : setup.faces) pair = {FreeSlip{}, FreeSlip{}};
  GasSolver solver(decomposition, grid, halo, setup, timer);
  GasState gas(grid);
  const double volume = 0.05;
  Transfer transfer(decomposition, grid, halo, {.particle_volume = volume}, timer);
  solver.prepare(gas, 0);
  Exchange exchange(grid);

  ParticleStore cloud;
  for (int p = 0; p < 60; ++p) cloud.add(p, {std::fmod(0.37 * p, 4), 4 + std::fmod(0.11 * p, 2), std::fmod(0.71 * p, 3)}, {}, {});
  const double dt = 0.01, amplitude = 1.5, omega = 2;
  Field before(grid);
  transfer.deposit_volume(cloud, gas.fraction);
  const std::vector<Vec3> home = cloud.positions();
  for (int step = 1; step <= 30; ++step) {
    before = gas.fraction;
    for (std::size_t p = 0; p < cloud.owned; ++p) cloud.position(p).y = home[p].y + amplitude * std::sin(omega * step * dt);
    ASSERT_EQ(transfer.deposit_volume(cloud, gas.fraction), 0);  // else the floor would hide solids
    for (std::size_t c = 0; c < gas.fraction.size(); ++c) {
      gas.fraction_rate.data()[c] = (gas.fraction.data()[c] - before.data()[c]) / dt;
    }
    const GasOutcome outcome = solver.advance(gas, &exchange, step * dt, dt);
    ASSERT_TRUE(outcome.converged) << outcome.reason;
    double stored = 0, largest = 0;
    for (int j = 0; j < 12; ++j) {
      double through = 0;
      for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 4; ++i) {
          through += 0.5 * (gas.fraction(i, j, k) + gas.fraction(i, j - 1, k)) * gas.velocity[1](i, j, k);
        }
      largest = std::max(largest, std::abs(stored));
      EXPECT_NEAR(through, -stored, 1e-7 * (1 + largest)) << step << " " << j;  // the solver's tolerance
      for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 4; ++i) stored += gas.fraction_rate(i, j, k);
    }
    EXPECT_GT(largest, 0.1);  // gas does move
  }
}

// ---------------------------------------------------------------------------------------- exchange

// Whatever the solvers leave undone: what the gas lost the particles received.
TEST(Exchange, ClosesToRoundOffByEitherSolver) {
  const Comm self = Comm::self();
  for (const char* solver : {"simple {}", "projection {}"}) {
    PhaseTimer timer;
    const std::string monitor = R"(monitors { name: "exchange" momentum_balance {} interval: 0 })";
    const std::string text = with(small_bed("coulomb { friction: 0.3 }", monitor), "simple {}", solver);
    Simulation bed(make_plan(scene_of(self, text), 1), self, timer);
    bed.seed();
    for (int n = 0; n < 40; ++n) {
      bed.step();
      EXPECT_LT(bed.observation().momentum_residual, 1e-12) << solver;  // sums over 600 particles
    }
    EXPECT_GT(bed.observation().momentum_residual, 0) << solver;  // it was measured
  }
}

// ---------------------------------------------------------------------------------------- minimum fluidization

// Inflow raised slowly through a settled bed: its pressure drop follows Ergun, then stays at the bed's weight over its area.
TEST(Bed, LiftsAtTheMinimumFluidizationVelocityAndThenWeighsWhatItWeighs) {
  const Comm self = Comm::self();
  const double ramp = 0.5, fastest = 0.55, side = 7.2e-3, diameter = 1.2e-3;
  const std::string text = R"(name: "lift" domain { size { x: 0.0072 y: 0.048 z: 0.0072 } cells { x: 3 y: 20 z: 3 } faces {
      x_low { free_slip_wall {} } x_high { free_slip_wall {} } z_low { free_slip_wall {} } z_high { free_slip_wall {} }
      y_low { inflow { velocity: 0.55 ramp { duration: 0.5 } } } y_high { outflow {} } } }
    gravity { y: -9.81 } gas { density: 1.2 viscosity: 1.8e-5 simple {} upwind {} }
    particles { diameter: 0.0012 density: 1000 linear_spring_dashpot { stiffness: 440 restitution: 0.9 } frictionless {}
      symplectic_euler {} random { count: 700 seed: 2 region { low {} high { x: 0.0072 y: 0.046 z: 0.0072 } } settling { duration: 1 } } }
    coupling { ergun {} hat {} explicit {} } time { end: 0.5 })";
  PhaseTimer timer;
  Simulation bed(make_plan(scene_of(self, text), 1), self, timer);
  bed.seed();
  while (bed.settle()) continue;
  const double weight = 700 * 1000 * std::numbers::pi / 6 * cube(diameter) * 9.81 / (side * side);  // Pa

  // Ergun's drop over the settled bed, plane by plane of cells: floor and surface are looser than the middle.
  std::vector<double> planes(20);
  for (int j = 0; j < 20; ++j)
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) planes[j] += (*bed.observation().fraction)(i, j, k) / 9;
  const auto ergun_drop = [&](double u) {
    double drop = 0;
    for (const double e : planes) {
      drop += 0.0024 * (150 * (1 - e) * (1 - e) * 1.8e-5 * u / (diameter * diameter) + 1.75 * (1 - e) * 1.2 * u * u / diameter) /
              cube(e);
    }
    return drop;
  };
  double minimum = 0;  // U_mf: the drop carries the weight
  while (ergun_drop(minimum) < weight) minimum += 1e-4;

  double lifted_at = 0, plateau = 0;
  int samples = 0;
  while (!bed.finished()) {
    bed.step();
    ASSERT_FALSE(bed.failure()) << bed.failure().message;
    const Field& pressure = *bed.observation().pressure;
    double drop = 0;  // to the inlet plane: half a cell beyond the lowest centre
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) drop += (1.5 * pressure(i, 0, k) - 0.5 * pressure(i, 1, k)) / 9;
    const double velocity = std::min(1.0, bed.time() / ramp) * fastest;
    if (lifted_at == 0 && drop >= weight) lifted_at = velocity;
    if (velocity > 1.15 * minimum) {
      plateau += drop;
      ++samples;
    }
  }
  // Within a plane ε varies by ±0.03 a cell and the gas prefers the loose cells: less drop than the mean ε's, a later lift:
  // 1.018 here. The band was set before that was measured.
  EXPECT_NEAR(lifted_at / minimum, 1.03, 0.04) << "U_mf by Ergun: " << minimum;
  ASSERT_GT(samples, 100);
  // Bubbles and the bed's own acceleration move the drop around the weight; the mean of this much time is within 5 %.
  EXPECT_NEAR(plateau / samples / weight, 1, 0.05);
}

}  // namespace
}  // namespace bedflow
