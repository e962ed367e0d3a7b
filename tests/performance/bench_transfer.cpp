// µs per particle and gas step of the transfer, both ways, on the grids of the ready cases in a fluidized state.
//
// A random bed at a solids fraction of 0.4, in the order in which the pair list keeps particles; gas that streams through it. One
// call is what a step of explicit exchange does: volume, b and bV to the grid, U and ∇p back.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <random>

#include "coupling/transfer.h"
#include "hardware.h"
#include "particles/cells.h"

namespace bedflow {
namespace {

struct Bed {
  Int3 cells;
  Vec3 size;  // m
  std::size_t count;
  double diameter;  // m
};

const Bed mueller{{18, 48, 4}, {0.044, 0.12, 0.01}, 9240, 1.2e-3};
const Bed goldschmidt{{30, 140, 3}, {0.15, 0.7, 0.015}, 24750, 2.49e-3};
const Bed link{{14, 250, 14}, {0.154, 1, 0.084}, 44800, 4.04e-3};

double volume(const Bed& bed) {
  return std::numbers::pi / 6 * bed.diameter * bed.diameter * bed.diameter;
}

ParticleStore particles(const Bed& bed) {
  const double height = static_cast<double>(bed.count) * volume(bed) / 0.4 / (bed.size.x * bed.size.z);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Vec3> places(bed.count);
  for (Vec3& x : places) x = {share(random) * bed.size.x, share(random) * height, share(random) * bed.size.z};
  Cells cells;
  cells.sort(places, 1.2 * bed.diameter);
  ParticleStore store;
  for (const std::uint32_t p : cells.order()) {
    store.add(p, places[p], {share(random) - 0.5, share(random) - 0.5, share(random) - 0.5}, {});
  }
  store.gas_force.resize(bed.count);
  return store;
}

void transfer(benchmark::State& state, const Bed& bed, const Kernel& kernel = Hat{}) {
  const Decomposition decomposition(Comm::self(), bed.cells, bed.size, {false, false, false}, 1);
  const Grid grid(decomposition);
  PhaseTimer timer;
  Halo halo(decomposition, grid, timer);
  GasState gas(grid);
  Exchange exchange(grid);
  Transfer transfer(decomposition, grid, halo, {.kernel = kernel, .diameter = bed.diameter, .particle_volume = volume(bed)},
                    timer);
  ParticleStore store = particles(bed);
  for (int d = 0; d < 3; ++d)
    for (std::size_t at = 0; at < grid.size(); ++at) {
      const auto place = static_cast<double>(at);
      gas.velocity[d].data()[at] = (d == 1 ? 2 : 0) + 0.5 * std::sin(place + d);
      gas.pressure.data()[at] = 10 * std::cos(0.1 * place);
    }
  const DragScene scene{1.2, 1.8e-5, bed.diameter};
  for (auto _ : state) {
    transfer.deposit_volume(store, gas.fraction);
    transfer.find_drag(GidaspowBlended{}, scene, store, gas);
    transfer.deposit_drag(store, {}, exchange);
    transfer.sample(gas, store);
    benchmark::DoNotOptimize(store.gas_force.data());
  }
  const double calls = static_cast<double>(state.iterations()), count = static_cast<double>(bed.count);
  state.counters["figure"] =
      benchmark::Counter(calls * count * 1e-6, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);  // µs a particle
  state.SetLabel("us per particle and gas step");
  // A particle's row three times, its stencil written and read thrice, slip, ε, b and force; of the grid 13 fields each way, 9 of
  // them as shares too. At the least one multiply-add a share, of which there are 8 on each of 4 lattices: 1 volume, 4 slips, 9
  // deposits, 6 samples; and some 150 operations of the drag law.
  const double cells = static_cast<double>(grid.interior()), bytes = count * (3 * 64 + 4 * 64 + 80) + cells * 8 * (2 * 13 + 12);
  state.counters["memory_bound"] = bytes / triad_bandwidth(static_cast<std::size_t>(bytes)) / count * 1e6;
  state.counters["arithmetic_bound"] = (2 * 8 * 20 + 150) / peak_flops() * 1e6;
}

BENCHMARK_CAPTURE(transfer, mueller, mueller)->Name("mueller")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(transfer, goldschmidt, goldschmidt)->Name("goldschmidt")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(transfer, link, link)->Name("link")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(transfer, dpvm, mueller, SquareDpvm{})->Name("mueller/dpvm")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(transfer, gaussian, mueller, Gaussian{})->Name("mueller/gaussian")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace bedflow

int main(int argc, char** argv) {
  const bedflow::MpiSession session(&argc, &argv);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
