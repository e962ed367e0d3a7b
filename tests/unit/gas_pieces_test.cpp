// The pieces of the gas solver: boundary values and ghosts, the 7-point operator, its preconditioner and its solver.
#include <gtest/gtest.h>

#include <random>

#include "gas/boundaries.h"
#include "gas/pressure.h"

namespace bedflow {
namespace {

using Faces = std::array<std::array<Boundary, 2>, 3>;

struct Block {
  Block(Int3 cells, std::array<bool, 3> periodic, const Faces& faces, const Comm& comm = Comm::world())
      : decomposition(comm, cells, {0.1 * cells[0], 0.1 * cells[1], 0.1 * cells[2]}, periodic),
        grid(decomposition),
        halo(decomposition, grid, timer),
        boundaries(decomposition, grid, faces) {}
  template <class Act>
  void for_cells(Act act) const {
    for (int k = 0; k < grid.cells[2]; ++k)
      for (int j = 0; j < grid.cells[1]; ++j)
        for (int i = 0; i < grid.cells[0]; ++i) act(i, j, k);
  }
  Decomposition decomposition;
  Grid grid;
  PhaseTimer timer;
  Halo halo;
  Boundaries boundaries;
};

Faces walls() {
  Faces faces;
  for (auto& pair : faces) pair = {FreeSlip{}, FreeSlip{}};
  return faces;
}

TEST(Boundaries, SolvedFacesAreThoseBetweenCellsAndTheOutflows) {
  Faces faces = walls();
  faces[1][1] = Outflow{};
  const Block b({4, 6, 4}, {false, false, true}, faces);
  const std::int64_t solved[3] = {3 * 6 * 4, 4 * 6 * 4, 4 * 6 * 4};
  for (int d = 0; d < 3; ++d) {
    const Int3 n = b.grid.cells;
    const std::int64_t mine = b.boundaries.last_solved(d) + 1 - b.boundaries.first_solved(d);
    EXPECT_EQ(b.decomposition.comm().sum(mine * n[(d + 1) % 3] * n[(d + 2) % 3]), solved[d]) << d;
  }
  EXPECT_TRUE(b.boundaries.open());
}

TEST(Boundaries, PeriodicDirectionHasNoOutflow) {
  Faces faces = walls();
  faces[1][1] = Outflow{};
  EXPECT_FALSE(Block({4, 4, 4}, {false, true, false}, faces).boundaries.open());
}

TEST(Boundaries, PatchesShareTheFaceByTheAreaTheyCover) {
  Faces faces = walls();
  Inflow inflow{{1, 0, 0}, {}};
  inflow.patches = {{{0.13, 0, 0.08}, {0.27, 0, 0.2}, {5, 0, 0}},
                    {{0.27, 0, 0.08}, {0.3, 0, 0.2}, {9, 3, 2}}};  // side by side in a cell
  faces[1][0] = inflow;
  const Block b({6, 4, 4}, {false, false, false}, faces);
  FaceField velocity(b.grid);
  Field fraction(b.grid, 0.5);
  b.boundaries.set_normal_velocity(velocity, fraction, 1.0);  // half-way up the second ramp: 6
  double flow = 0;
  if (b.boundaries.at(1, 0)) b.for_cells([&](int i, int j, int k) { flow += j == 0 ? 0.5 * velocity[1](i, 0, k) * 0.01 : 0; });
  const double area1 = 0.14 * 0.12, area2 = 0.03 * 0.12;
  EXPECT_NEAR(b.decomposition.comm().sum(flow), 0.24 - area1 - area2 + 5 * area1 + 6 * area2, 1e-14);  // round-off
}

TEST(Boundaries, GhostsGiveTheWallItsVelocityAndTheOutflowItsPressure) {
  Faces faces = walls();
  faces[0] = {NoSlip{{0, 3, 4}}, Outflow{7}};
  const Block b({4, 4, 4}, {false, false, false}, faces);
  FaceField velocity(b.grid, 1);
  Field pressure(b.grid, 2);
  b.boundaries.set_velocity_beyond(velocity);
  const int n = b.grid.cells[0];
  if (b.boundaries.at(0, 0)) {
    EXPECT_EQ(0.5 * (velocity[1](-1, 1, 1) + velocity[1](0, 1, 1)), 3);
    EXPECT_EQ(0.5 * (velocity[2](-1, 1, 1) + velocity[2](0, 1, 1)), 4);
  }
  if (b.boundaries.at(0, 1)) {
    EXPECT_EQ(velocity[1](n, 1, 1), 1);
    b.boundaries.set_pressure(pressure, true);
    EXPECT_EQ(pressure(n, 1, 1), 7);
    b.boundaries.set_pressure(pressure, false);
    EXPECT_EQ(0.5 * (pressure(n, 1, 1) + pressure(n - 1, 1, 1)), 7);
  }
}

// One random problem: ε and mobility of a wide range on the faces that are solved.
struct Problem {
  Problem(Int3 cells, std::array<bool, 3> periodic, const Faces& faces, const Comm& comm = Comm::world(),
          Preconditioner preconditioner = Preconditioner::incomplete_cholesky)
      : block(cells, periodic, faces, comm),
        work(block.grid),
        pressure(block.decomposition, block.grid, block.halo, block.boundaries, preconditioner, work),
        fraction(block.grid, 1),
        velocity(block.grid) {
    std::mt19937 random(static_cast<unsigned>(7 + block.decomposition.comm().rank()));
    std::uniform_real_distribution<double> decade(-2, 2), plain(-1, 1);
    for (int d = 0; d < 3; ++d) {
      Int3 high = block.grid.cells, low{0, 0, 0};
      low[d] = block.boundaries.first_solved(d);
      high[d] = block.boundaries.last_solved(d) + 1;
      for_rows(block.grid, low, high, [&](auto c, int n) {
        for (auto i = c; i < c + n; ++i) {
          pressure.mobility()[d].data()[i] = std::pow(10, decade(random));
          velocity[d].data()[i] = plain(random);
        }
      });
    }
    block.halo.fill(velocity);
  }
  double imbalance() const {  // Σ|Σ ε u A| over all cells
    double sum = 0;
    block.for_cells([&](int i, int j, int k) {
      sum += std::abs(velocity[0](i + 1, j, k) - velocity[0](i, j, k) + velocity[1](i, j + 1, k) - velocity[1](i, j, k) +
                      velocity[2](i, j, k + 1) - velocity[2](i, j, k)) *
             0.01;
    });
    return block.decomposition.comm().sum(sum);
  }
  Block block;
  Workspace work;
  PressureCorrection pressure;
  Field fraction;  // 1
  FaceField velocity;
};

TEST(PressureCorrection, LeavesNoCellOutOfBalance) {
  Faces open = walls();
  open[1][1] = Outflow{};
  open[0][0] = Outflow{};
  for (const auto& [faces, periodic] : {std::pair{walls(), std::array<bool, 3>{false, false, false}},
                                        {open, {false, false, false}},
                                        {walls(), {true, true, true}},
                                        {walls(), {false, true, false}}}) {
    for (const Preconditioner preconditioner :
         {Preconditioner::multigrid, Preconditioner::incomplete_cholesky, Preconditioner::unpreconditioned}) {
      Problem problem({12, 10, 8}, periodic, faces, Comm::world(), preconditioner);
      const Field still(problem.block.grid);
      Field p(problem.block.grid);
      const double before = problem.imbalance();
      problem.pressure.assemble(problem.fraction);
      problem.pressure.set_imbalance(problem.fraction, problem.velocity, still);
      const auto result = problem.pressure.solve(1e-10, 0);
      problem.pressure.correct(problem.velocity, p, problem.fraction, 1);
      problem.block.halo.fill(problem.velocity);
      EXPECT_LT(problem.imbalance(), 1e-8 * before);  // 1e-10 of the root mean square, summed over 960 cells
      EXPECT_NEAR(problem.imbalance(), result.imbalance, 1e-10 * before);
    }
  }
}

// MIC's condition number is that of the row length, not of its square (Gustafsson 1978). Within one block: blocks do not see each
// other's part of the preconditioner.
TEST(PressureCorrection, IterationsGrowWithTheRootOfTheGrid) {
  Faces open = walls();
  open[1][1] = Outflow{};
  const auto iterations = [&](int n) {
    Problem problem({n, n, n}, {false, false, false}, open, Comm::self());
    for (Field& component : problem.pressure.mobility().component)
      for (std::size_t i = 0; i < component.size(); ++i) component.data()[i] = component.data()[i] != 0 ? 1 : 0;
    problem.pressure.assemble(problem.fraction);
    problem.pressure.set_imbalance(problem.fraction, problem.velocity, Field(problem.block.grid));
    return problem.pressure.solve(1e-6, 0).iterations;
  };
  const int coarse = iterations(8), fine = iterations(32);
  EXPECT_LT(fine, 2.5 * coarse) << coarse;  // √4, and a quarter for 8 cells being few; plain gradients: 4
  EXPECT_LT(fine, 50);
}

TEST(PressureCorrection, NothingToCorrectTakesNoIteration) {
  Problem problem({6, 6, 6}, {false, false, false}, walls());
  const FaceField still(problem.block.grid);
  problem.pressure.assemble(problem.fraction);
  problem.pressure.set_imbalance(problem.fraction, still, Field(problem.block.grid));
  EXPECT_EQ(problem.pressure.solve(1e-2, 0).iterations, 0);
}

// A row of cells has no fill-in, so its factorisation is the matrix itself.
TEST(IncompleteCholesky, IsExactInOneDimension) {
  const Decomposition alone(Comm::self(), {9, 1, 1}, {0.9, 0.1, 0.1}, {false, false, false});
  const Grid grid(alone);

  SevenPoint matrix(grid);
  for (int i = 0; i <= 9; ++i) matrix.coupling[0](i, 0, 0) = 1 + 0.3 * i;  // held to 0 at both ends
  IncompleteCholesky preconditioner(grid);
  preconditioner.factor(matrix);
  Field x(grid), r(grid), z(grid);
  for (int i = 0; i < 9; ++i) x(i, 0, 0) = std::sin(i + 1.0);
  for (int i = 0; i < 9; ++i)
    r(i, 0, 0) = matrix.coupling[0](i, 0, 0) * (x(i, 0, 0) - x(i - 1, 0, 0)) +
                 matrix.coupling[0](i + 1, 0, 0) * (x(i, 0, 0) - x(i + 1, 0, 0));
  preconditioner.apply(matrix, r, z);
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(z(i, 0, 0), x(i, 0, 0), 1e-12);  // round-off
}

TEST(IncompleteCholesky, IsSymmetric) {
  Problem problem({6, 5, 4}, {false, false, false}, walls());
  problem.pressure.assemble(problem.fraction);
  IncompleteCholesky preconditioner(problem.block.grid);
  preconditioner.factor(problem.pressure.matrix());
  const Grid& grid = problem.block.grid;
  Field a(grid), b(grid), za(grid), zb(grid);
  problem.block.for_cells([&](int i, int j, int k) {
    a(i, j, k) = std::sin(i + 2 * j + 5 * k);
    b(i, j, k) = std::cos(3 * i + j + k);
  });
  preconditioner.apply(problem.pressure.matrix(), a, za);
  preconditioner.apply(problem.pressure.matrix(), b, zb);
  double ab = 0, ba = 0;
  problem.block.for_cells([&](int i, int j, int k) {
    ab += b(i, j, k) * za(i, j, k);
    ba += a(i, j, k) * zb(i, j, k);
  });
  EXPECT_NEAR(ab / ba, 1, 1e-10);  // round-off of a sum with four decades in it
}

}  // namespace
}  // namespace bedflow
