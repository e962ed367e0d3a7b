// The gas on 1, 2 and 4 ranks against one rank alone.
#include <gtest/gtest.h>

#include "gas_box.h"

namespace bedflow {
namespace {

// The preconditioner and the sweeps know the blocks, so iterates differ, and the answers agree to the tolerance only.
constexpr double tolerance = 1e-10, agreement = 1e-7;

struct Scene {
  Int3 cells;
  Vec3 size;
  std::array<bool, 3> periodic;
  GasSetup setup;
};

void load(GasBox& box) {
  const Grid& g = box.grid;
  box.for_cells([&](int i, int j, int k) {
    const double x = box.centre(0, i), y = box.centre(1, j), z = box.centre(2, k);
    box.state.fraction(i, j, k) = 0.7 + 0.2 * std::sin(150 * x) * std::cos(100 * y) * std::cos(60 * z);
  });
  for (int d = 0; d < 3; ++d) {
    const GasSolver::Range range = box.solver.solved_faces(d);
    Int3 low{0, 0, 0}, high = g.cells;
    low[d] = range.low;
    high[d] = range.high + 1;
    for (int k = low[2]; k < high[2]; ++k)
      for (int j = low[1]; j < high[1]; ++j)
        for (int i = low[0]; i < high[0]; ++i) {
          const double wave = std::sin(0.5 * (g.first[0] + i) + 0.3 * (g.first[1] + j) + 0.8 * (g.first[2] + k));
          box.exchange.drag[d](i, j, k) = (1000 + 900 * wave) * g.cell_volume();
          box.exchange.drag_momentum[d](i, j, k) = box.exchange.drag[d](i, j, k) * 0.1 * d * wave;
          box.exchange.buoyancy[d](i, j, k) = 0.3 + 0.1 * wave;
        }
  }
}

void expect_same_on_all_ranks(Scene scene) {
  scene.setup.tolerance = tolerance;
  GasBox whole(scene.cells, scene.size, scene.periodic, scene.setup, Comm::self());
  GasBox part(scene.cells, scene.size, scene.periodic, scene.setup, Comm::world());
  load(whole);
  load(part);
  for (int step = 0; step < 2; ++step) {
    const GasOutcome a = whole.step(2e-4, true), b = part.step(2e-4, true);
    ASSERT_TRUE(a.converged) << a.reason;
    ASSERT_TRUE(b.converged) << b.reason;
  }
  double fastest = 0, highest = 0;
  whole.for_cells([&](int i, int j, int k) {
    for (int d = 0; d < 3; ++d) fastest = std::max(fastest, std::abs(whole.state.velocity[d](i, j, k)));
    highest = std::max(highest, std::abs(whole.state.pressure(i, j, k)));
  });
  const Int3 first = part.grid.first;
  for (int d = 0; d < 3; ++d) {
    const GasSolver::Range range = part.solver.solved_faces(d);
    Int3 low{0, 0, 0}, high = part.grid.cells;
    low[d] = range.low;
    high[d] = range.high + 1;
    for (int k = low[2]; k < high[2]; ++k)
      for (int j = low[1]; j < high[1]; ++j)
        for (int i = low[0]; i < high[0]; ++i)
          ASSERT_NEAR(part.state.velocity[d](i, j, k), whole.state.velocity[d](i + first[0], j + first[1], k + first[2]),
                      agreement * fastest);
  }
  part.for_cells([&](int i, int j, int k) {
    ASSERT_NEAR(part.state.pressure(i, j, k), whole.state.pressure(i + first[0], j + first[1], k + first[2]),
                agreement * highest);
  });
  for (int d = 0; d < 3; ++d) EXPECT_NEAR(part.state.fall[d], whole.state.fall[d], agreement * norm(whole.state.fall));
  EXPECT_NEAR(part.solver.balance().in, whole.solver.balance().in, agreement * (1e-6 + whole.solver.balance().in));
}

TEST(GasRanks, BedBetweenInflowPatchAndOutflowIsTheSameOnAnyNumber) {
  for (int up = 0; up < 3; ++up) {
    Scene scene{{8, 8, 8}, {0.04, 0.04, 0.04}, {false, false, false}, still_air()};
    scene.cells[up] = 12;
    scene.setup.gravity[up] = -9.81;
    scene.setup.faces[(up + 1) % 3] = {NoSlip{}, NoSlip{{0.1, 0.1, 0.1}}};
    scene.setup.faces[up] = {Inflow{{0.4, 0, 0}, {{{0.011, 0.011, 0.011}, {0.031, 0.031, 0.031}, {3, 0, 0}}}}, Outflow{10}};
    expect_same_on_all_ranks(scene);
    std::swap(scene.setup.faces[up][0], scene.setup.faces[up][1]);
    expect_same_on_all_ranks(scene);
    scene.setup.convection = Smart{};
    expect_same_on_all_ranks(scene);
  }
}

TEST(GasRanks, PeriodicBoxIsTheSameOnAnyNumber) {
  Scene scene{{8, 6, 10}, {0.04, 0.03, 0.05}, {true, true, true}, still_air()};
  scene.setup.gravity = {1, -9.81, 2};
  for (const Convection& scheme : {Convection(Upwind{}), Convection(Smart{}), Convection(Superbee{})}) {
    scene.setup.convection = scheme;
    expect_same_on_all_ranks(scene);
  }
}

// Rectangles that lie across the blocks of every rank, in a box that is driven both ways.
TEST(GasRanks, PanelsAndDrivenFlowAreTheSameOnAnyNumber) {
  for (int normal = 0; normal < 3; ++normal) {
    Scene scene{{8, 8, 8}, {0.04, 0.04, 0.04}, {true, true, true}, still_air()};
    const auto rectangle = [&](double at, double from, double to) {
      Vec3 low{from, from, from}, high{to, to, to};
      low[normal] = high[normal] = at;
      return std::pair{low, high};
    };
    const auto [low, high] = rectangle(0.02, 0.005, 0.03);
    const auto [plate_low, plate_high] = rectangle(0.015, 0.01, 0.04);
    scene.setup.panels = {{low, high, Baffle{}}, {plate_low, plate_high, Plate{20, 2}}};
    scene.setup.drive[(normal + 1) % 3].mass_flux = 0.5;
    scene.setup.drive[normal].pressure_drop = 3;
    scene.setup.convection = Smart{};
    expect_same_on_all_ranks(scene);
  }
}

TEST(GasRanks, ClosedBoxIsTheSameOnAnyNumber) {
  Scene scene{{8, 12, 4}, {0.04, 0.06, 0.02}, {false, false, true}, still_air()};
  scene.setup.faces[1][1] = NoSlip{{0.5, 0, 0.1}};
  expect_same_on_all_ranks(scene);
}

TEST(GasRanks, EveryRankHearsTheSameReason) {
  GasBox box({8, 8, 8}, {0.04, 0.04, 0.04}, {true, true, true}, still_air(), Comm::world());
  if (Comm::world().root()) box.exchange.buoyancy[0](1, 1, 1) = 2;
  const GasOutcome outcome = box.step(1e-3, true);
  EXPECT_FALSE(outcome.converged);
  EXPECT_EQ(outcome.reason, Comm::world().broadcast(outcome.reason));
}

}  // namespace
}  // namespace bedflow
