// The pressure's linear systems by our preconditioners, by unpreconditioned BiCGStab, and by conjugate gradients with hypre's
// PFMG (where it is installed: Debian's libhypre-dev), to the same residual: 1e-6 of the right side, root mean square. A table of
// iterations and µs of CPU time a cell, what the preconditioner needs beforehand included. One core.
//
// And of the multigrid alone, whether its iterations are as many on any grid, for cells of all shapes.
//
// usage: bench_pressure [TEXT]     only the systems with TEXT in their name
#include <cstdio>
#include <ctime>
#include <optional>
#include <string>

#include "support/pressure_system.h"

#ifdef BEDFLOW_HYPRE
#include <HYPRE_krylov.h>
#include <HYPRE_struct_ls.h>
#endif

namespace bedflow {
namespace {

constexpr double reduction = 1e-6;
constexpr int most_iterations = 500;

struct Outcome {
  int iterations = 0;
  double seconds = 0;  // CPU
  bool reached = true;
};

double cpu_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

Outcome ours(const PressureSystem::Kind& kind, Preconditioner preconditioner) {
  PressureSystem system(kind);
  ConjugateGradients solver(system.decomposition, system.grid, system.halo, preconditioner, system.work, kind.up);
  Field x(system.grid);
  const double start = cpu_seconds();
  solver.factor(system.matrix);
  const auto result = solver.solve(system.matrix, system.singular(), system.right, x, reduction, 0);
  return {result.iterations, cpu_seconds() - start, result.reached};
}

// Van der Vorst (1992), without a preconditioner: the linear solver of the MFIX-Exa of 2018.
Outcome bicgstab(const PressureSystem::Kind& kind) {
  PressureSystem system(kind);
  const Grid& grid = system.grid;
  const double *cx = system.matrix.coupling[0].data(), *cy = system.matrix.coupling[1].data(),
               *cz = system.matrix.coupling[2].data();
  const std::ptrdiff_t sy = grid.stride(1), sz = grid.stride(2);
  const auto multiply = [&](Field& from, Field& to) {
    system.halo.fill(from);
    const double* p = from.data();
    double* q = to.data();
    for_rows(grid, [=](auto first, int n) {
      for (auto c = first; c < first + n; ++c)
        q[c] = cx[c] * (p[c] - p[c - 1]) + cx[c + 1] * (p[c] - p[c + 1]) + cy[c] * (p[c] - p[c - sy]) +
               cy[c + sy] * (p[c] - p[c + sy]) + cz[c] * (p[c] - p[c - sz]) + cz[c + sz] * (p[c] - p[c + sz]);
    });
  };
  const auto dot = [&](const Field& a, const Field& b) {
    double sum = 0;
    for_rows(grid, [&](auto first, int n) {
      for (auto c = first; c < first + n; ++c) sum += a.data()[c] * b.data()[c];
    });
    return sum;
  };
  // to = a + s b + t c
  const auto combine = [&](Field& to, const Field& a, double s, const Field& b, double t, const Field& c) {
    for_rows(grid, [&](auto first, int n) {
      for (auto i = first; i < first + n; ++i) to.data()[i] = a.data()[i] + s * b.data()[i] + t * c.data()[i];
    });
  };
  Field x(grid), p(grid), v(grid), s(grid), t(grid);
  Field& r = system.right;
  const double start = cpu_seconds();
  const Field shadow = r;
  double rho = 1, alpha = 1, omega = 1;
  const double target = reduction * reduction * dot(r, r);
  Outcome outcome;
  while (dot(r, r) > target && outcome.iterations < most_iterations) {
    const double next = dot(shadow, r), beta = next / rho * alpha / omega;
    rho = next;
    combine(p, r, beta, p, -beta * omega, v);
    multiply(p, v);
    alpha = rho / dot(shadow, v);
    combine(s, r, -alpha, v, 0, v);
    multiply(s, t);
    omega = dot(t, s) / dot(t, t);
    combine(x, x, alpha, p, omega, s);
    combine(r, s, -omega, t, 0, t);
    ++outcome.iterations;
  }
  outcome.reached = dot(r, r) <= target;
  outcome.seconds = cpu_seconds() - start;
  return outcome;
}

#ifdef BEDFLOW_HYPRE
std::optional<Outcome> pfmg(const PressureSystem::Kind& kind) {
  const PressureSystem system(kind);
  if (system.singular()) return std::nullopt;  // hypre leaves the constant to its caller
  const Int3 n = kind.cells;
  HYPRE_StructGrid grid = nullptr;
  HYPRE_StructStencil stencil = nullptr;
  HYPRE_StructMatrix matrix = nullptr;
  HYPRE_StructVector b = nullptr, x = nullptr;
  HYPRE_StructSolver solver = nullptr, preconditioner = nullptr;
  int low[3] = {0, 0, 0}, high[3] = {n[0] - 1, n[1] - 1, n[2] - 1};
  HYPRE_StructGridCreate(MPI_COMM_SELF, 3, &grid);
  HYPRE_StructGridSetExtents(grid, low, high);
  HYPRE_StructGridAssemble(grid);
  int offsets[4][3] = {{0, 0, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, entries[4] = {0, 1, 2, 3};
  HYPRE_StructStencilCreate(3, 4, &stencil);
  for (int e = 0; e < 4; ++e) HYPRE_StructStencilSetElement(stencil, e, offsets[e]);
  HYPRE_StructMatrixCreate(MPI_COMM_SELF, grid, stencil, &matrix);
  HYPRE_StructMatrixSetSymmetric(matrix, 1);
  HYPRE_StructMatrixInitialize(matrix);
  std::vector<double> coefficients, right;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const std::ptrdiff_t c = system.grid.index(i, j, k);
        double diagonal = 0;
        for (int d = 0; d < 3; ++d)
          diagonal += system.matrix.coupling[d].data()[c] + system.matrix.coupling[d].data()[c + system.grid.stride(d)];
        coefficients.push_back(diagonal);
        for (int d = 0; d < 3; ++d) coefficients.push_back(-system.matrix.coupling[d].data()[c]);
        right.push_back(system.right(i, j, k));
      }
  HYPRE_StructMatrixSetBoxValues(matrix, low, high, 4, entries, coefficients.data());
  HYPRE_StructMatrixAssemble(matrix);
  for (HYPRE_StructVector* vector : {&b, &x}) {
    HYPRE_StructVectorCreate(MPI_COMM_SELF, grid, vector);
    HYPRE_StructVectorInitialize(*vector);
    HYPRE_StructVectorSetConstantValues(*vector, 0);
  }
  HYPRE_StructVectorSetBoxValues(b, low, high, right.data());
  HYPRE_StructVectorAssemble(b);
  HYPRE_StructVectorAssemble(x);

  const double start = cpu_seconds();
  HYPRE_StructPCGCreate(MPI_COMM_SELF, &solver);
  HYPRE_StructPCGSetMaxIter(solver, most_iterations);
  HYPRE_StructPCGSetTol(solver, reduction);
  HYPRE_StructPCGSetTwoNorm(solver, 1);
  HYPRE_StructPFMGCreate(MPI_COMM_SELF, &preconditioner);
  HYPRE_StructPFMGSetMaxIter(preconditioner, 1);
  HYPRE_StructPFMGSetTol(preconditioner, 0);
  HYPRE_StructPFMGSetZeroGuess(preconditioner);
  HYPRE_StructPFMGSetRelaxType(preconditioner, 2);  // red-black Gauss-Seidel, symmetric
  HYPRE_StructPFMGSetRAPType(preconditioner, 1);    // seven points on every level
  HYPRE_StructPFMGSetSkipRelax(preconditioner, 1);
  HYPRE_StructPCGSetPrecond(solver, HYPRE_StructPFMGSolve, HYPRE_StructPFMGSetup, preconditioner);
  HYPRE_StructPCGSetup(solver, matrix, b, x);
  HYPRE_StructPCGSolve(solver, matrix, b, x);
  Outcome outcome;
  outcome.seconds = cpu_seconds() - start;
  double left = 0;
  HYPRE_StructPCGGetNumIterations(solver, &outcome.iterations);
  HYPRE_StructPCGGetFinalRelativeResidualNorm(solver, &left);
  outcome.reached = left <= reduction;
  HYPRE_StructPCGDestroy(solver);
  HYPRE_StructPFMGDestroy(preconditioner);
  HYPRE_StructVectorDestroy(b);
  HYPRE_StructVectorDestroy(x);
  HYPRE_StructMatrixDestroy(matrix);
  HYPRE_StructStencilDestroy(stencil);
  HYPRE_StructGridDestroy(grid);
  return outcome;
}
#else
std::optional<Outcome> pfmg(const PressureSystem::Kind&) {
  return std::nullopt;
}
#endif

std::string cell(const std::optional<Outcome>& outcome, double cells) {
  if (!outcome) return "             -";
  char text[32];
  std::snprintf(text, sizeof text, "%5d%s%8.3f", outcome->iterations, outcome->reached ? " " : "!",
                outcome->seconds / cells * 1e6);
  return text;
}

void row(const std::string& wanted, const std::string& name, const PressureSystem::Kind& kind) {
  if (name.find(wanted) == std::string::npos) return;
  const double cells = static_cast<double>(kind.cells[0]) * kind.cells[1] * kind.cells[2];
  const bool slow = cells > 3e5;  // too long for what has no multigrid
  using Maybe = std::optional<Outcome>;
  const Maybe cholesky = slow ? Maybe() : ours(kind, Preconditioner::incomplete_cholesky);
  const Maybe plain = slow ? Maybe() : bicgstab(kind);
  std::printf("%-34s %s %s %s %s\n", name.c_str(), cell(ours(kind, Preconditioner::multigrid), cells).c_str(),
              cell(pfmg(kind), cells).c_str(), cell(cholesky, cells).c_str(), cell(plain, cells).c_str());
  std::fflush(stdout);
}

void table(const std::string& wanted) {
  std::printf(
      "iterations and us a cell                multigrid     hypre PFMG     inc. Cholesky       BiCGStab    (!: not reached)\n");
  using Kind = PressureSystem::Kind;
  for (const int n : {16, 32, 64, 128}) {
    const Int3 cube{n, n, n};
    const std::string size = std::to_string(n) + "^3, ";
    row(wanted, size + "clear gas", Kind{.cells = cube, .bed = false});
    row(wanted, size + "drag 1", Kind{.cells = cube, .drag = 1});
    row(wanted, size + "drag 1e3", Kind{.cells = cube, .drag = 1e3});
    row(wanted, size + "drag 1e6", Kind{.cells = cube, .drag = 1e6});
    row(wanted, size + "drag 1e3, cells 1:8:1", Kind{.cells = cube, .edge = {1, 8, 1}, .drag = 1e3});
    row(wanted, size + "drag 1e3, cells 8:1:8", Kind{.cells = cube, .edge = {8, 1, 8}, .drag = 1e3});
  }
  for (const double drag : {1.0, 1e3}) {
    const std::string with = drag > 1 ? ", drag 1e3" : ", drag 1";
    row(wanted, "Mueller 18 x 48 x 4" + with, Kind{.cells = {18, 48, 4}, .drag = drag});
    row(wanted, "Goldschmidt 30 x 140 x 3" + with, Kind{.cells = {30, 140, 3}, .drag = drag});
    row(wanted, "Link 14 x 250 x 14" + with, Kind{.cells = {14, 250, 14}, .edge = {11, 4, 6}, .drag = drag});
    row(wanted, "SSCP-I 36 x 192 x 12" + with, Kind{.cells = {36, 192, 12}, .drag = drag});
  }
}

// Wide in one direction, flat in one, and of three different edges.
void shapes(const std::string& wanted) {
  constexpr int sizes[] = {16, 32, 64, 128};
  std::printf("\niterations and us a cell, multigrid           16^3           32^3           64^3          128^3\n");
  for (const Vec3 edge : {Vec3{8, 1, 1}, {1, 8, 1}, {1, 1, 8}, {1, 8, 8}, {8, 1, 8}, {8, 8, 1}, {8, 4, 1}, {4, 1, 8}, {1, 4, 8}})
    for (const double drag : {0.0, 1.0, 1e3, 1e6}) {
      char name[64];
      std::snprintf(name, sizeof name, "cells %g:%g:%g, drag %g", edge.x, edge.y, edge.z, drag);
      if (std::string(name).find(wanted) == std::string::npos) continue;
      std::printf("%-34s", name);
      for (const int n : sizes) {
        const double cells = static_cast<double>(n) * n * n;
        std::printf(" %s",
                    cell(ours({.cells = {n, n, n}, .edge = edge, .drag = drag}, Preconditioner::multigrid), cells).c_str());
        std::fflush(stdout);
      }
      std::printf("\n");
    }
}

}  // namespace
}  // namespace bedflow

int main(int argc, char** argv) {
  const bedflow::MpiSession session(&argc, &argv);
#ifdef BEDFLOW_HYPRE
  int started = 0;  // hypre wants MPI even where nobody launched ranks
  MPI_Initialized(&started);
  if (!started) MPI_Init(&argc, &argv);  // the session ends it
#endif
  const std::string wanted = argc > 1 ? argv[1] : "";
  bedflow::table(wanted);
  bedflow::shapes(wanted);
}
