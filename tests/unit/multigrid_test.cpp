// The multigrid: symmetric, positive definite, and as fast whatever the grid, the coefficients and the number of ranks.
#include "gas/multigrid.h"

#include <gtest/gtest.h>

#include "support/pressure_system.h"

namespace bedflow {
namespace {

using Kind = PressureSystem::Kind;

constexpr std::array<bool, 3> all_periodic{true, true, true};

std::vector<Kind> kinds() {
  return {{.cells = {12, 16, 8}, .drag = 1e6},
          {.cells = {15, 45, 9}, .drag = 1e3},
          {.cells = {16, 12, 20}, .edge = {1, 8, 8}},
          {.cells = {16, 12, 20}, .edge = {8, 1, 3}, .open = false, .drag = 100},
          {.cells = {17, 18, 20}, .edge = {5, 5, 1}, .open = false, .drag = 1e6},
          {.cells = {17, 40, 7}, .edge = {8, 1, 8}, .periodic = {true, false, true}, .drag = 1e3},
          // By lines along x; along y of cells long in z, levels turned; along z, which no level begins with:
          {.cells = {14, 20, 18}, .edge = {1, 4, 6}, .drag = 1e3, .up = 0},
          {.cells = {18, 12, 20}, .edge = {1, 1, 6}, .drag = 1e3},
          {.cells = {7, 22, 16}, .edge = {1, 5, 1}, .drag = 1e6, .up = 2},
          {.cells = {9, 15, 5}, .periodic = all_periodic, .bed = false},
          {.cells = {4, 40, 3}, .periodic = {false, true, true}, .drag = 10}};
}

int iterations(const Kind& kind, const Comm& comm = Comm::self()) {
  PressureSystem system(kind, comm);
  ConjugateGradients solver(system.decomposition, system.grid, system.halo, Preconditioner::multigrid, system.work, kind.up);
  solver.factor(system.matrix);
  Field x(system.grid);
  return solver.solve(system.matrix, system.singular(), system.right, x, 1e-6, 0).iterations;
}

TEST(Multigrid, IsSymmetric) {
  for (const Kind& kind : kinds()) {
    const PressureSystem system(kind, Comm::world());
    Multigrid multigrid(system.decomposition, system.grid, kind.up);
    multigrid.factor(system.matrix);
    Field a(system.grid), b(system.grid), ma(system.grid), mb(system.grid);
    for (int k = 0; k < system.grid.cells[2]; ++k)
      for (int j = 0; j < system.grid.cells[1]; ++j)
        for (int i = 0; i < system.grid.cells[0]; ++i) {
          a(i, j, k) = system.noise({i, j, k}, 2);
          b(i, j, k) = system.noise({i, j, k}, 3);
        }
    multigrid.apply(a, 1, ma);
    multigrid.apply(b, 1, mb);
    std::array<double, 4> sums{};
    for_rows(system.grid, [&](auto c, int n) {
      for (auto i = c; i < c + n; ++i) {
        sums[0] += a.data()[i] * mb.data()[i];
        sums[1] += b.data()[i] * ma.data()[i];
        sums[2] += std::abs(a.data()[i] * mb.data()[i]);
        sums[3] += a.data()[i] * ma.data()[i];
      }
    });
    system.decomposition.comm().sum(sums);
    EXPECT_NEAR(sums[0], sums[1], 1e-5 * sums[2]);  // single precision, some hundred additions deep
    EXPECT_GT(sums[3], 0);
  }
}

// A cycle takes the error's energy down: 0 < λ(M A) < 2, which conjugate gradients could not show.
TEST(Multigrid, TakesEnergyFromEveryError) {
  for (const Kind& kind : kinds()) {
    const PressureSystem system(kind, Comm::world());
    const Grid& grid = system.grid;
    Multigrid multigrid(system.decomposition, grid, kind.up);
    multigrid.factor(system.matrix);
    Field error(grid), residual(grid), correction(grid);
    for (const double wave : {0.0, 0.05, 0.3, 3.1}) {
      for (int k = 0; k < grid.cells[2]; ++k)
        for (int j = 0; j < grid.cells[1]; ++j)
          for (int i = 0; i < grid.cells[0]; ++i) {
            const double phase = wave * (i + grid.first[0] + 1.3 * (j + grid.first[1]) + 0.7 * (k + grid.first[2]));
            error(i, j, k) = wave > 0 ? std::sin(phase) : system.noise({i, j, k}, 4);
          }
      // Energy e·A e as the sum over faces; A e into residual.
      const auto energy = [&](Field& e) {
        PhaseTimer timer;
        Halo halo(system.decomposition, grid, timer);
        halo.fill(e);
        double sum = 0;
        for (int k = 0; k < grid.cells[2]; ++k)
          for (int j = 0; j < grid.cells[1]; ++j)
            for (int i = 0; i < grid.cells[0]; ++i) {
              double flow = 0;
              for (int d = 0; d < 3; ++d) {
                const std::ptrdiff_t c = grid.index(i, j, k), s = grid.stride(d);
                const double* g = system.matrix.coupling[d].data();
                flow += g[c] * (e.data()[c] - e.data()[c - s]) + g[c + s] * (e.data()[c] - e.data()[c + s]);
              }
              residual(i, j, k) = flow;
              sum += flow * e(i, j, k);
            }
        return system.decomposition.comm().sum(sum);
      };
      const double before = energy(error);
      multigrid.apply(residual, 1, correction);
      for (int k = 0; k < grid.cells[2]; ++k)
        for (int j = 0; j < grid.cells[1]; ++j)
          for (int i = 0; i < grid.cells[0]; ++i) error(i, j, k) -= correction(i, j, k);
      EXPECT_LT(energy(error), before) << wave;
    }
  }
}

TEST(Multigrid, IterationsDoNotGrowWithTheGrid) {
  const std::vector<std::pair<Kind, int>> most = {{{.bed = false}, 5},
                                                  {{.periodic = all_periodic, .bed = false}, 5},
                                                  {{.drag = 1}, 6},
                                                  {{.drag = 1e3}, 10},
                                                  {{.drag = 1e6}, 14},
                                                  {{.open = false, .drag = 1e6}, 14},
                                                  {{.edge = {1, 8, 1}, .drag = 1e3}, 10},
                                                  {{.edge = {8, 1, 1}, .drag = 1e3}, 8},
                                                  {{.edge = {1, 8, 8}, .drag = 1e3}, 10},
                                                  // Flat cells, by lines:
                                                  {{.edge = {8, 1, 8}, .bed = false}, 5},
                                                  {{.edge = {2, 1, 2}, .drag = 1e3}, 7},
                                                  {{.edge = {8, 1, 8}, .drag = 1e3}, 7},
                                                  {{.edge = {8, 1, 8}, .drag = 1e6}, 8},
                                                  {{.edge = {8, 8, 1}, .drag = 1e3}, 9}};
  if (Comm::world().size() > 1) GTEST_SKIP() << "on one rank; the next test compares ranks";
  for (auto [kind, bound] : most) {
    std::string seen;
    for (const int n : {16, 32, 64}) {
      kind.cells = {n, n, n};
      const int count = iterations(kind);
      seen += " " + std::to_string(count);
      EXPECT_LE(count, bound) << n << " drag " << kind.drag << " edge " << kind.edge.x << ":" << seen;
    }
  }
}

// Cells long in one direction, or flat in one, with roofs across any: as many iterations at any size. Where roofs lie across
// lines they are solved for, 6 to 9; where lines stand otherwise the coarse levels see a thin roof as those of cubes do: the
// smallest grids, whose levels are few, take 6, all others 10 to 14.
TEST(Multigrid, IterationsDoNotGrowWithTheGridWhateverTheShapeOfCells) {
  if (Comm::world().size() > 1) GTEST_SKIP() << "on one rank; the next test compares ranks";
  const std::vector<std::pair<Vec3, std::array<int, 3>>> most = {// by the direction that is up
                                                                 {{8, 1, 1}, {9, 8, 8}},   {{1, 8, 1}, {8, 9, 8}},
                                                                 {{1, 1, 8}, {8, 8, 9}},   {{1, 8, 8}, {8, 14, 14}},
                                                                 {{8, 1, 8}, {14, 8, 14}}, {{8, 8, 1}, {14, 14, 8}}};
  for (const auto& [edge, bounds] : most)
    for (const int up : {0, 1, 2}) {
      std::string seen;
      for (const int n : {16, 32, 64}) {
        const int count = iterations({.cells = {n, n, n}, .edge = edge, .drag = 1e6, .up = up});
        seen += " " + std::to_string(count);
        EXPECT_LE(count, bounds[static_cast<std::size_t>(up)])
            << n << " up " << up << " edge " << edge.x << ":" << edge.y << ":" << edge.z << ":" << seen;
      }
    }
}

TEST(Multigrid, IterationsDoNotDependOnTheRanks) {
  for (Kind kind : kinds()) {
    for (int d = 0; d < 3; ++d) kind.cells[d] *= kind.cells[d] > 8 ? 2 : 1;
    const int alone = iterations(kind), together = iterations(kind, Comm::world());
    EXPECT_NEAR(together, alone, 2) << kind.cells[0];  // blocks with odd counts are joined elsewhere than the whole box
  }
}

TEST(Multigrid, TakesThinBedsAndAnyNumberOfCells) {
  for (const int thin : {1, 2, 3, 4})
    for (const int up : {15, 45, 90})
      for (const double drag : {0.0, 1e6}) {
        EXPECT_LE(iterations({.cells = {30, up, thin}, .drag = drag}), 16) << thin << " " << up << " " << drag;
        EXPECT_LE(iterations({.cells = {thin, up, 30}, .edge = {4, 1, 1}, .drag = drag}), 16) << thin << " " << up << " " << drag;
      }
  EXPECT_EQ(iterations({.cells = {1, 1, 1}}), 1);
  EXPECT_EQ(iterations({.cells = {1, 1, 1}, .periodic = all_periodic}), 0);
}

// Every preconditioner finds the same x, down to what double precision leaves.
TEST(ConjugateGradients, EveryPreconditionerFindsTheSolution) {
  for (const Kind& kind : kinds())
    for (const Preconditioner choice :
         {Preconditioner::multigrid, Preconditioner::incomplete_cholesky, Preconditioner::unpreconditioned}) {
      if (choice == Preconditioner::unpreconditioned && kind.drag >= 1e3)
        continue;  // does not get there in thousands of iterations
      PressureSystem system(kind, Comm::world());
      ConjugateGradients solver(system.decomposition, system.grid, system.halo, choice, system.work, kind.up);
      solver.factor(system.matrix);
      Field x(system.grid);
      Field b = system.right;
      if (system.singular()) {
        double sum = 0;
        for_rows(system.grid, [&](auto c, int n) {
          for (auto i = c; i < c + n; ++i) sum += b.data()[i];
        });
        const double mean = system.decomposition.comm().sum(sum) / (kind.cells[0] * kind.cells[1] * kind.cells[2]);
        for (std::size_t i = 0; i < b.size(); ++i) b.data()[i] -= mean;
      }
      solver.solve(system.matrix, system.singular(), system.right, x, 1e-9, 0);
      system.halo.fill(x);
      Field residual(system.grid);
      for (int k = 0; k < system.grid.cells[2]; ++k)
        for (int j = 0; j < system.grid.cells[1]; ++j)
          for (int i = 0; i < system.grid.cells[0]; ++i) {
            double flow = 0;
            for (int d = 0; d < 3; ++d) {
              const std::ptrdiff_t c = system.grid.index(i, j, k), s = system.grid.stride(d);
              const double* g = system.matrix.coupling[d].data();
              flow += g[c] * (x.data()[c] - x.data()[c - s]) + g[c + s] * (x.data()[c] - x.data()[c + s]);
            }
            residual(i, j, k) = b(i, j, k) - flow;
          }
      // What is left, computed anew: 1e-9, and round-off of x, which is up to 1e6 times b where drag is.
      EXPECT_LT(std::sqrt(system.squares(residual) / system.squares(b)), 2e-9) << static_cast<int>(choice) << " " << kind.drag;
    }
}

}  // namespace
}  // namespace bedflow
