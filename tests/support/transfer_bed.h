// A bed without contacts between the grid and its transfer, for tests of these.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "coupling/transfer.h"

namespace bedflow {

// A box with walls in x and y, periodic in z, and particles everywhere, next to faces, edges and corners too.
struct Bed {
  static constexpr double volume = 5e-4;
  Kernel kernel;
  double diameter;
  int ghosts;
  Decomposition decomposition;
  Grid grid;
  PhaseTimer timer;
  Halo halo;
  GasState gas;
  Exchange exchange;
  Transfer transfer;
  ParticleStore particles;

  explicit Bed(Int3 cells, int count = 400, const Kernel& with = Hat{}, double size = 0.08)
      : kernel(with),
        diameter(size),
        ghosts(kernel_ghosts(kernel, diameter, {1.0 / cells[0], 2.0 / cells[1], 1.5 / cells[2]}, 0, true)),
        decomposition(Comm::world(), cells, {1, 2, 1.5}, {false, false, true}, -1,
                      {std::min(ghosts, cells[0]), std::min(ghosts, cells[1]), std::min(ghosts, cells[2])}),
        grid(decomposition, ghosts),
        halo(decomposition, grid, timer),
        gas(grid),
        exchange(grid),
        transfer(decomposition, grid, halo, {.kernel = kernel, .diameter = diameter, .particle_volume = volume}, timer) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> share(0, 1);
    for (int p = 0; p < count; ++p) {
      Vec3 place{share(random), 2 * share(random), 1.5 * share(random)};
      if (p < 8) place = {p % 2 == 0 ? 0 : 1.0, p / 2 % 2 == 0 ? 0 : 2.0, p / 4 == 0 ? 0 : 1.4999};  // corners of the box
      const Vec3 velocity{share(random) - 0.5, share(random) - 0.5, share(random) - 0.5};
      if (decomposition.owner(place) != decomposition.comm().rank()) continue;
      particles.add(p, place, velocity, {});
    }
    particles.gas_force.resize(particles.owned);
  }

  template <class Value>
  void each_cell(Value value) {
    for (int k = 0; k < grid.cells[2]; ++k)
      for (int j = 0; j < grid.cells[1]; ++j)
        for (int i = 0; i < grid.cells[0]; ++i) value(i, j, k);
  }
  void stir_gas() {  // any velocity and pressure: a function of the global place, so that ranks agree
    for (int d = 0; d < 3; ++d)
      each_cell([&](int i, int j, int k) {
        gas.velocity[d](i, j, k) =
            std::sin(1.0 + d + 3 * (grid.first[0] + i) + 5 * (grid.first[1] + j) + 7 * (grid.first[2] + k));
      });
    each_cell([&](int i, int j, int k) {
      gas.pressure(i, j, k) = 100 * std::cos(2.0 * (grid.first[0] + i) + 3 * (grid.first[1] + j) + (grid.first[2] + k));
    });
    halo.fill(gas.velocity);
    halo.fill(gas.pressure);
  }
};

}  // namespace bedflow
