// Baffles and plates inside the box.
#include <gtest/gtest.h>

#include "gas_box.h"

namespace bedflow {
namespace {

// A plate across a uniform stream: Δp = R₁ u + R₂ ρg u², u superficial, and nothing else changes.
TEST(Plate, TakesExactlyItsPressureDrop) {
  const double speed = 0.7;
  const Plate plate{30, 4};
  for (int along = 0; along < 3; ++along)
    for (const auto& [epsilon, method] :
         {std::pair{1.0, GasMethod::simple}, {0.5, GasMethod::simple}, {0.5, GasMethod::projection}}) {
      GasSetup setup = still_air();
      setup.method = method;
      setup.faces[along] = {Inflow{{speed, 0, 0}, {}}, Outflow{3}};
      setup.tolerance = setup.pressure_tolerance = 1e-10;
      Int3 cells{4, 4, 4};
      cells[along] = 12;
      Vec3 size{0.02, 0.02, 0.02}, low{}, high = size;
      size[along] = 0.06;
      low[along] = high[along] = 0.025;
      setup.panels = {{low, high, plate}};
      GasBox box(cells, size, {false, false, false}, setup);
      set_fraction(box, [epsilon = epsilon](double, double, double) { return epsilon; });
      for (int n = 0; n < 100; ++n) ASSERT_TRUE(box.step(0.01).converged);  // a projection's pressure settles step by step
      const double drop = plate.linear * speed + plate.quadratic * 1.2 * speed * speed;
      EXPECT_NEAR((*box.state.jump)[along](along == 0 ? 5 : 1, along == 1 ? 5 : 1, along == 2 ? 5 : 1), drop, 1e-7 * drop);
      box.for_cells([&, through = speed / epsilon](int i, int j, int k) {
        const int at[3] = {i, j, k};
        EXPECT_NEAR(box.state.pressure(i, j, k), 3 + (at[along] < 5 ? drop : 0), 1e-7 * drop);  // tolerance
        EXPECT_NEAR(box.state.velocity[along](i, j, k), through, 1e-7);
      });
    }
}

// Of two plates side by side each takes the flow that the common drop drives through it: R₁ u₁ = R₁' u₂ with thin slip walls
// between.
TEST(Plate, SideBySideShareTheFlowByTheirResistance) {
  GasSetup setup = still_air();
  setup.viscosity = 0;
  setup.faces[1] = {Inflow{{1, 0, 0}, {}}, Outflow{}};
  setup.tolerance = 1e-8;
  // A baffle keeps the two streams apart beyond the plates; resistance is 1000 times what inertia can do.
  setup.panels = {{{0, 0.02, 0}, {0.02, 0.02, 0.01}, Plate{3000, 0}},
                  {{0.02, 0.02, 0}, {0.04, 0.02, 0.01}, Plate{1000, 0}},
                  {{0.02, 0.02, 0}, {0.02, 0.08, 0.01}, Baffle{}}};
  GasBox box({8, 16, 2}, {0.04, 0.08, 0.01}, {false, false, false}, setup);
  ASSERT_TRUE(box.settle(0.01, 1e-6, 300));
  const auto flow = [&](int from, int to) {
    double sum = 0;
    for (int i = from; i < to; ++i) sum += 0.25 * box.state.velocity[1](i, 4, 0);
    return sum;
  };
  EXPECT_NEAR(flow(0, 4) + flow(4, 8), 2, 1e-6);      // the inflow
  EXPECT_NEAR(flow(4, 8) / flow(0, 4), 3, 3 * 5e-3);  // ρu² is 1e-3 of R₁ u
}

// A baffle along a periodic channel makes two channels of half the height, and each is that channel, cell by cell.
TEST(Baffle, AlongAChannelMakesTwo) {
  for (int along = 0; along < 3; ++along)
    for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{})}) {
      const int across = (along + 1) % 3;
      const auto run = [&](bool divided) {
        GasSetup setup = still_air();
        setup.convection = scheme;
        setup.viscosity = 0.01;
        setup.faces[across] = {NoSlip{}, NoSlip{}};
        setup.drive[along].pressure_drop = 3;
        setup.tolerance = 1e-10;
        setup.velocity_relaxation = 0.9;  // the problem is linear
        setup.max_iterations = 5000;
        Int3 cells{3, 3, 3};
        cells[across] = divided ? 16 : 8;
        Vec3 size{0.01, 0.01, 0.01}, low{}, high = size;
        size[across] = divided ? 0.01 : 0.005;
        low[across] = high[across] = 0.005;
        if (divided) setup.panels = {{low, high, Baffle{}}};
        std::array<bool, 3> periodic{true, true, true};
        periodic[across] = false;
        auto box = std::make_unique<GasBox>(cells, size, periodic, setup);
        EXPECT_TRUE(box->settle(0.01, 1e-11, 100));
        return box;
      };
      const auto divided = run(true), half = run(false);
      const double fastest = half->state.velocity[along](1, 1, 1);
      divided->for_cells([&](int i, int j, int k) {
        Int3 at{i, j, k};
        EXPECT_NEAR(divided->state.velocity[across](at[0], at[1], at[2]), 0, 1e-10 * fastest);
        at[across] %= 8;
        EXPECT_NEAR(divided->state.velocity[along](i, j, k), half->state.velocity[along](at[0], at[1], at[2]), 1e-7 * fastest);
      });
    }
}

// Half a channel is barred: all gas goes round, none through, and on the baffle there is no velocity along it.
TEST(Baffle, GasGoesRoundIt) {
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{}), Convection(Superbee{})}) {
    GasSetup setup = upright(0.5);
    setup.convection = scheme;
    setup.viscosity = 0.001;
    setup.panels = {{{0, 0.03, 0}, {0.02, 0.03, 0.01}, Baffle{}}};
    setup.tolerance = 1e-7;
    GasBox box({16, 24, 2}, {0.04, 0.06, 0.01}, {false, false, true}, setup);
    ASSERT_TRUE(box.settle(0.01, 1e-5, 200));
    double through = 0;
    for (int i = 0; i < 16; ++i) {
      const double u = box.state.velocity[1](i, 12, 0);
      if (i < 8) {
        EXPECT_EQ(u, 0);
      }
      through += u / 16;
    }
    EXPECT_NEAR(through, 0.5, 1e-6);                   // tolerance
    EXPECT_GT(box.state.velocity[1](12, 12, 0), 0.9);  // twice the speed through the gap
    EXPECT_LT(box.state.velocity[1](4, 14, 0), 0.3);   // and a lee behind it
    EXPECT_NEAR(box.solver.balance().in, box.solver.balance().out, 1e-6 * box.solver.balance().in);
  }
}

}  // namespace
}  // namespace bedflow
