// µs per cell and step of the gas on grids of the ready cases in a fluidized state, second-order convection: SIMPLE to residuals
// of 1e-3, and the projection, its pressure to 1e-6 of the right side.
//
// The bed is a prescribed one: below half height ε 0.42 with ripples and a rising bubble, Ergun's drag, particles that swirl; it
// moves from step to step. What a step costs beside the solver (filling the exchange) is not counted.
#include <benchmark/benchmark.h>

#include <malloc.h>

#include <cmath>

#include "gas/gas_solver.h"
#include "hardware.h"

namespace bedflow {
namespace {

struct Bed {
  Int3 cells;
  Vec3 size;  // m
  double diameter, inflow, dt;
};

constexpr Bed mueller{{18, 48, 4}, {0.044, 0.12, 0.01}, 1.2e-3, 0.9, 1e-4};
constexpr Bed goldschmidt{{30, 140, 3}, {0.15, 0.7, 0.015}, 2.49e-3, 1.875, 2e-4};
constexpr Bed cube(int n) {
  return {{n, n, n}, {0.0025 * n, 0.0025 * n, 0.0025 * n}, 1.2e-3, 0.9, 1e-4};
}

class MovingBed {
 public:
  MovingBed(const Bed& bed, GasMethod method, Preconditioner preconditioner)
      : bed_(bed),
        decomposition_(Comm::world(), bed.cells, bed.size, {false, false, false}, 1),
        grid_(decomposition_, ghosts_of(Smart{})),
        halo_(decomposition_, grid_, timer_),
        solver_(decomposition_, grid_, halo_, setup(bed, method, preconditioner), timer_),
        state_(grid_),
        exchange_(grid_) {
    solver_.prepare(state_, 0);
  }

  void move_particles() {
    const double next = time_ + bed_.dt;
    for_range({0, 0, 0}, grid_.cells, [&](int i, int j, int k) {
      const Vec3 x{at(0, i, 0.5), at(1, j, 0.5), at(2, k, 0.5)};
      state_.fraction(i, j, k) = fraction(x, next);
      state_.fraction_rate(i, j, k) = (fraction(x, next) - fraction(x, time_)) / bed_.dt;
    });
    for (int d = 0; d < 3; ++d) {
      Int3 low{0, 0, 0}, high = grid_.cells;
      low[d] = grid_.first[d] == 0 ? 1 : 0;
      for_range(low, high, [&](int i, int j, int k) {
        const Vec3 x{at(0, i, d == 0 ? 0 : 0.5), at(1, j, d == 1 ? 0 : 0.5), at(2, k, d == 2 ? 0 : 0.5)};
        const double epsilon = fraction(x, next), solids = 1 - epsilon;
        const double density =
            150 * 1.8e-5 * solids * solids / (epsilon * bed_.diameter * bed_.diameter) + 1.75 * 1.2 * solids / bed_.diameter;
        const double velocity =
            d == 1 ? 0.2 * std::sin(10 * x.x / bed_.size.x + 50 * time_) : 0.1 * std::sin(20 * x.y / bed_.size.y);
        exchange_.drag[d](i, j, k) = density * grid_.cell_volume();
        exchange_.drag_momentum[d](i, j, k) = exchange_.drag[d](i, j, k) * velocity;
        exchange_.buoyancy[d](i, j, k) = solids;
      });
    }
    Comm::world().barrier();  // no rank waits within its step for the others' particles
  }
  GasOutcome step() {
    GasOutcome outcome = solver_.advance(state_, &exchange_, time_, bed_.dt);
    time_ += bed_.dt;
    return outcome;
  }
  double cells() const { return static_cast<double>(grid_.interior()); }

 private:
  static GasSetup setup(const Bed& bed, GasMethod method, Preconditioner preconditioner) {
    GasSetup result;
    result.method = method;
    if (method == GasMethod::projection) result.pressure_tolerance = 1e-6;
    result.preconditioner = preconditioner;
    result.convection = Smart{};
    result.density = 1.2;
    result.viscosity = 1.8e-5;
    result.gravity = {0, -9.81, 0};
    result.faces = {{{NoSlip{}, NoSlip{}}, {Inflow{{bed.inflow, 0, 0}, {}}, Outflow{}}, {FreeSlip{}, FreeSlip{}}}};
    return result;
  }
  double at(int d, int i, double shift) const { return grid_.low[d] + (i + shift) * grid_.spacing[d]; }
  double fraction(Vec3 x, double time) const {
    if (x.y > 0.5 * bed_.size.y) return 1;
    const double bx = (x.x / bed_.size.x - 0.5) / 0.2, by = (x.y - 0.15 * bed_.size.y - 0.3 * time) / (0.2 * bed_.size.x);
    const double bubble = std::exp(-bx * bx - by * by);
    const double ripple =
        0.05 * std::sin(40 * x.x / bed_.size.x + 300 * time) * std::sin(80 * x.y / bed_.size.y) * std::cos(4 * x.z / bed_.size.z);
    return std::min(1.0, 0.42 + ripple + (0.95 - 0.42) * bubble);
  }
  template <class Act>
  static void for_range(Int3 low, Int3 high, Act act) {
    for (int k = low[2]; k < high[2]; ++k)
      for (int j = low[1]; j < high[1]; ++j)
        for (int i = low[0]; i < high[0]; ++i) act(i, j, k);
  }

  const Bed bed_;
  Decomposition decomposition_;
  Grid grid_;
  PhaseTimer timer_;
  Halo halo_;
  GasSolver solver_;
  GasState state_;
  Exchange exchange_;
  double time_ = 0;
};

void steps(benchmark::State& state, const Bed& bed, GasMethod method, Preconditioner preconditioner) {
  MovingBed moving(bed, method, preconditioner);
  for (int n = 0; n < 10; ++n) {
    moving.move_particles();
    moving.step();
  }
  double done = 0, outer = 0, inner = 0;
  for (auto _ : state) {
    state.PauseTiming();
    moving.move_particles();
    state.ResumeTiming();
    const GasOutcome outcome = moving.step();
    if (!outcome.converged) {
      state.SkipWithError(outcome.reason.c_str());
      break;
    }
    done += moving.cells();
    outer += outcome.iterations;
    inner += outcome.pressure_iterations;
  }
  const double count = done / moving.cells();
  state.SetLabel("us per cell and step");
  state.counters["figure"] = benchmark::Counter(done * 1e-6, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["outer"] = outer / count;
  state.counters["pressure_iterations"] = inner / count;
  // Doubles that each outer iteration (assembly and a sweep of three components, pressure coefficients and their factors) and
  // each iteration of the pressure solver stream once, at this machine's own speed for a solver of 60 doubles a cell.
  const double bandwidth = triad_bandwidth(static_cast<std::size_t>(moving.cells() * 60 * 8));
  state.counters["memory_bound"] = 8 * (170 * outer + 32 * inner) / count / bandwidth * 1e6;
}

// What solver, state and exchange keep on the heap, a cell.
void memory(benchmark::State& state, GasMethod method) {
  const auto in_use = [] {
    const struct mallinfo2 heap = mallinfo2();
    return static_cast<double>(heap.uordblks + heap.hblkhd);
  };
  double bytes = 0;
  for (auto _ : state) {
    const double before = in_use();
    MovingBed moving(cube(64), method, Preconditioner::multigrid);
    moving.move_particles();
    moving.step();
    bytes = (in_use() - before) / moving.cells();
  }
  state.counters["figure"] = bytes;
  state.SetLabel("bytes per cell");
}

void add(const std::string& name, const Bed& bed, GasMethod method, Preconditioner preconditioner, int iterations = 0) {
  auto* entry = benchmark::RegisterBenchmark(name.c_str(), steps, bed, method, preconditioner)->Unit(benchmark::kMillisecond);
  if (iterations > 0) entry->Iterations(iterations);
}

// Under mpirun all ranks do the same only where the number of iterations is given: choose one with --benchmark_filter.
void add_all() {
  constexpr auto simple = GasMethod::simple, projection = GasMethod::projection;
  constexpr auto multigrid = Preconditioner::multigrid, cholesky = Preconditioner::incomplete_cholesky;
  add("simple/mueller", mueller, simple, cholesky);
  add("simple/goldschmidt", goldschmidt, simple, cholesky);
  add("simple/cube64", cube(64), simple, multigrid);
  add("projection/mueller", mueller, projection, cholesky);
  add("projection/goldschmidt", goldschmidt, projection, multigrid);
  add("projection/cube64", cube(64), projection, multigrid);
  add("projection/cube96", cube(96), projection, multigrid, 10);
  add("projection/cube128", cube(128), projection, multigrid);
  benchmark::RegisterBenchmark("projection/memory", memory, projection)->Iterations(1);
  benchmark::RegisterBenchmark("simple/memory", memory, simple)->Iterations(1);
  // The other way to precondition, beside those.
  add("simple/goldschmidt/multigrid", goldschmidt, simple, multigrid);
  add("simple/cube64/incomplete_cholesky", cube(64), simple, cholesky);
  add("projection/mueller/multigrid", mueller, projection, multigrid);
  add("projection/goldschmidt/incomplete_cholesky", goldschmidt, projection, cholesky);
}

// Of the ranks but the first.
class Silent : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& /*context*/) override { return true; }
  void ReportRuns(const std::vector<Run>& /*runs*/) override {}
};

}  // namespace
}  // namespace bedflow

int main(int argc, char** argv) {
  const bedflow::MpiSession session(&argc, &argv);
  bedflow::add_all();
  benchmark::Initialize(&argc, argv);
  bedflow::Silent silent;
  if (bedflow::Comm::world().root())
    benchmark::RunSpecifiedBenchmarks();
  else
    benchmark::RunSpecifiedBenchmarks(&silent);
}
