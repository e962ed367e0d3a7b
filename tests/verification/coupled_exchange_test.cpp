// The exchange between gas and particles over whole steps: closed to round-off, right whatever the step.
#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <utility>

#include "support/scene.h"

namespace bedflow {
namespace {

// A closed box of gas with a cloud of particles that touch neither each other nor a wall.
struct Cloud {
  static constexpr double diameter = 1e-3, density = 1500, dt = 2e-3;
  static constexpr int substeps = 10;
  const double volume = std::numbers::pi / 6 * diameter * diameter * diameter, mass = density * volume;
  const bool leaks;  // some stand at the floor, through which they can leave; no gravity
  const Vec3 gravity = leaks ? Vec3{} : Vec3{1, -9.81, 0.5};
  Decomposition decomposition{Comm::world(), {8, 12, 8}, {0.02, 0.03, 0.02}, {false, false, true}, -1, {2, 2, 2}};
  PhaseTimer timer;
  Grid grid{decomposition, 2};
  Halo halo{decomposition, grid, timer};
  GasState gas{grid};
  Exchange exchange{grid};
  ExchangeScheme scheme;
  DragScene scene{1.2, 0.05, diameter};  // so thick that b dt/m is about 1.5
  GasSolver solver;
  Transfer transfer;
  Dem dem;
  Vec3 lost;  // impulse, N·s

  Cloud(const ExchangeScheme& with, const Kernel& kernel, bool open = false)
      : leaks(open),
        scheme(with),
        solver(decomposition, grid, halo, gas_setup(), timer),
        transfer(decomposition, grid, halo,
                 {.kernel = kernel,
                  .diameter = diameter,
                  .particle_volume = volume,
                  .mass = mass,
                  .gravity = gravity,
                  .scheme = scheme},
                 timer),
        dem(decomposition, dem_setup(),
            {LawTable<LinearSpringDashpot>{{{1, 0}}, {{1, 0}}}, LawTable<Frictionless>{{{}}, {{}}}, {}, {}}, timer) {
    ParticleStore cloud;
    for (int p = 0; p < 400; ++p) {  // on a skewed lattice, 2.4 diameters apart at least
      const int row = p / 6 % 8, layer = p / 48;
      const Vec3 place{0.003 + 0.0028 * (p % 6) + 1e-4 * (p % 7), (leaks ? 0.0001 : 0.004) + 0.0028 * row,
                       0.001 + 0.0024 * layer};
      if (decomposition.owner(place) != decomposition.comm().rank()) continue;
      cloud.add(p, place, {0.1 * std::sin(p), 0.1 * std::cos(2 * p), 0.1 * std::sin(3 * p)}, {});
    }
    dem.set_particles(std::move(cloud));
    solver.prepare(gas, 0);
    transfer.deposit_volume(dem.particles(), gas.fraction);
  }
  GasSetup gas_setup() const {
    GasSetup setup{
        .density = 1.2, .viscosity = scene.viscosity, .gravity = gravity, .tolerance = 1e-5, .pressure_tolerance = 1e-4};
    for (int d = 0; d < 2; ++d) setup.faces[d] = {NoSlip{}, NoSlip{}};
    if (leaks) setup.faces[1][1] = Outflow{0};  // gas takes the place of those that leave
    return setup;
  }
  DemSetup dem_setup() const {
    DemSetup setup{.types = {{diameter / 2, density, false}}, .gravity = gravity, .skin = 0.4 * diameter};
    setup.gas = std::holds_alternative<Explicit>(scheme) ? GasForce::frozen : GasForce::relaxed;
    setup.sides[2] = {Side::periodic, Side::periodic};
    if (leaks) setup.sides[1][0] = Side::outlet;
    return setup;
  }
  void find_drag() { transfer.find_drag(WenYu{}, scene, dem.particles(), gas); }
  void step() {
    const Field before = gas.fraction;
    transfer.deposit_volume(dem.particles(), gas.fraction);
    for (std::size_t c = 0; c < before.size(); ++c)
      gas.fraction_rate.data()[c] = (gas.fraction.data()[c] - before.data()[c]) / dt;
    find_drag();
    transfer.deposit_drag(dem.particles(), {dt, substeps}, exchange);
    ASSERT_TRUE(solver.advance(gas, &exchange, 0, dt).converged);
    transfer.sample(gas, dem.particles());
    const ExchangeBalance balance = transfer.balance(gas, exchange, dem.particles());
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(balance.lost_by_gas[d], balance.received_by_particles[d], 1e-13 * balance.scale[d]);
    lost += dt * balance.lost_by_gas;
    for (int s = 0; s < substeps; ++s) {
      if (std::holds_alternative<SubStepped>(scheme)) {
        transfer.locate(dem.particles());
        find_drag();
        transfer.pull(dem.particles());
      }
      dem.advance(1, dt / substeps);
    }
    ASSERT_FALSE(dem.failure()) << dem.failure().message;
  }
  // Sums over all particles: m V − what the gas still owes, kg·m/s.
  Vec3 momentum() const {
    Vec3 sum;
    const ParticleStore& store = dem.particles();
    for (std::size_t p = 0; p < store.owned; ++p) {
      sum += mass * store.velocity(p);
      if (!store.gas_response.empty()) sum -= store.gas_response[p].debt;
    }
    for (int d = 0; d < 3; ++d) sum[d] = decomposition.comm().sum(sum[d]);
    return sum;
  }
};

// Impulse lost by the gas, gravity's, and what is still owed are what the particles' momentum has changed by.
TEST(Exchange, ClosesOverManyStepsWithEverySchemeAndKernel) {
  for (const ExchangeScheme& scheme : {ExchangeScheme(Explicit{}), ExchangeScheme(SubStepped{}), ExchangeScheme(SemiImplicit{})})
    for (const Kernel& kernel : {Kernel(Hat{}), Kernel(SquareDpvm{}), Kernel(Gaussian{{}, 6})}) {
      Cloud cloud(scheme, kernel);
      const Vec3 before = cloud.momentum();
      const int steps = 6;
      for (int s = 0; s < steps; ++s) cloud.step();
      const Vec3 fall = steps * Cloud::dt * 400 * cloud.mass * cloud.gravity;
      const Vec3 gained = cloud.momentum() - before - fall;
      EXPECT_GT(norm(gained), 1e-2 * norm(fall));                                                           // the gas does matter
      EXPECT_LT(norm(gained - cloud.lost), 1e-12 * norm(fall)) << scheme.index() << " " << kernel.index();  // 400 · 6 · 10 sums
    }
}

// Those that leave take along what the gas lost for them, or has not yet lost: the account says how much.
TEST(Exchange, ClosesWithThoseThatHaveLeft) {
  for (const ExchangeScheme& scheme : {ExchangeScheme(SubStepped{}), ExchangeScheme(SemiImplicit{})}) {
    Cloud cloud(scheme, Hat{}, true);
    const Comm& comm = cloud.decomposition.comm();
    const Vec3 before = cloud.momentum();
    for (int s = 0; s < 6; ++s) cloud.step();
    const Departed gone = cloud.dem.take_departed();
    EXPECT_GT(comm.sum(gone.amount.count), 10);
    EXPECT_GT(comm.max(norm(gone.debt)), 1e-6 * norm(before));  // the account has something to tell
    Vec3 left = gone.momentum - gone.debt;
    for (int d = 0; d < 3; ++d) left[d] = comm.sum(left[d]);
    const double scale = 400 * cloud.mass * 0.1;  // of the particles' momenta
    EXPECT_LT(norm(cloud.momentum() + left - before - cloud.lost), 1e-12 * scale) << scheme.index();
    EXPECT_GT(norm(cloud.lost), 1e-3 * scale);
  }
}

// Uniform settling in a closed box, the gas displaced upwards: V = v_t ε^n with n = 4.65 where Re is small (Richardson & Zaki
// 1954, Trans. Inst. Chem. Eng. 32, 35). Wen & Yu's law holds that exponent: 2.65, 1 for the superficial velocity and 1 for the
// buoyancy of the mixture. Particles of 10 µm: m/b is a tenth of the step and less.
struct Settling {
  static constexpr double diameter = 10e-6, terminal = (1500 - 1.2) * 9.81 * diameter * diameter / 18 / 1.8e-5;
  static constexpr std::array<std::pair<double, double>, 4> ratios = {
      {{0.1, 0.61267}, {0.2, 0.35430}, {0.3, 0.19042}, {0.4, 0.09298}}};  // solids fraction and V/v_t

  double cell;  // m; two particles in each direction
  std::string text;
  explicit Settling(double solids, const std::string& more = "") : cell(diameter * std::cbrt(8 * std::numbers::pi / 6 / solids)) {
    const auto length = [&](int cells) { return std::to_string(1e6 * cells * cell) + "e-6"; };
    const std::string size = "x: " + length(4) + " y: " + length(16) + " z: " + length(4);
    text = "name: \"settling\" domain { size { " + size + R"( } cells { x: 4 y: 16 z: 4 }
        periodic { x: true z: true } faces { y_low { free_slip_wall {} } y_high { free_slip_wall {} } } }
      gravity { y: -9.81 }
      gas { density: 1.2 viscosity: 1.8e-5 simple { tolerance: 1e-5 max_iterations: 3000 } upwind {} }
      particles { diameter: 10e-6 density: 1500 linear_spring_dashpot { stiffness: 4e-6 restitution: 0.9 } frictionless {}
        symplectic_euler {} lattice { count { x: 8 y: 32 z: 8 } } )" +
           more + "} coupling { wen_yu {} hat {} semi_implicit {} } time { end: 1 step: 5e-4 }";
  }

  // Mean velocity downwards after eight steps, far from floor and surface, over the terminal velocity of one particle.
  double ratio() const {
    const Comm world = Comm::world();
    PhaseTimer timer;
    Simulation box(make_plan(scene_of(world, text), world.size()), world, timer);
    box.seed();
    for (int s = 0; s < 8; ++s) box.step();
    EXPECT_FALSE(box.failure()) << box.failure().message;
    const ParticleStore& store = box.particles()->particles();
    double sum = 0, count = 0;
    for (std::size_t p = 0; p < store.owned; ++p) {
      if (std::abs(store.position(p).y - 8 * cell) > 3 * cell) continue;
      sum -= store.velocity(p).y;
      ++count;
    }
    return world.sum(sum) / world.sum(count) / terminal;
  }
};

TEST(HinderedSettling, FollowsRichardsonZaki) {
  const Comm world = Comm::world();
  for (const auto& [solids, expected] : Settling::ratios) {
    const Settling box(solids);
    EXPECT_THROW(make_plan(scene_of(world, with(box.text, "semi_implicit", "explicit")), world.size()), Stop);
    EXPECT_NEAR(box.ratio() / expected, 1, 0.01) << solids;  // Re of 3e-3 makes 0.3 % of it
  }
}

// Parcels of eight fall as their particles; by themselves, twice as wide, they would fall four times as fast.
TEST(HinderedSettling, OfParcelsIsThatOfTheirParticles) {
  const Comm world = Comm::world();
  for (const auto& [solids, expected] : Settling::ratios) {
    const Settling box(solids, "coarse_graining { factor: 2 } ");
    if (solids == 0.4) {  // cells of 1.1 parcels
      EXPECT_THROW(scene_of(world, with(box.text, "factor: 2", "factor: 4")), Stop) << "parcels wider than cells";
    }
    const Plan parcels = make_plan(scene_of(world, box.text), world.size());
    const Plan particles = make_plan(scene_of(world, Settling(solids).text), world.size());
    EXPECT_EQ(8 * parcels.particle_count, particles.particle_count);
    EXPECT_NEAR(parcels.drag_limit / particles.drag_limit, 1, 1e-13);  // 2m/b of both
    EXPECT_NEAR(box.ratio() / expected, 1, 0.01) << solids;
  }
}

// One bed, three schemes, a step far below 2m/b: they tell the same story, the closer the smaller the step.
TEST(Exchange, SchemesAgreeAsTheStepShrinks) {
  const Comm world = Comm::world();
  const auto after = [&](const std::string& scheme, const std::string& step) {
    const std::string text =
        with(with(small_bed("frictionless {}"), "explicit", scheme), "time { end: 1", "time { end: 2e-3 step: " + step);
    PhaseTimer timer;
    Simulation bed(make_plan(scene_of(world, text), world.size()), world, timer);
    bed.seed();
    while (!bed.finished()) bed.step();
    EXPECT_FALSE(bed.failure());
    return world.sum(bed.particles()->kinetic_energy());
  };
  const double exact = after("explicit", "1e-5");
  for (const std::string scheme : {"explicit", "sub_stepped", "semi_implicit"}) {
    const double coarse = after(scheme, "1e-4") / exact - 1, fine = after(scheme, "2.5e-5") / exact - 1;
    EXPECT_LT(std::abs(fine), 0.6 * std::abs(coarse) + 1e-4) << scheme << " " << coarse << " " << fine;
    EXPECT_LT(std::abs(coarse), 0.05) << scheme;
  }
}

}  // namespace
}  // namespace bedflow
