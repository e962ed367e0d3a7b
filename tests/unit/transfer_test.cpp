#include "coupling/transfer.h"

#include <gtest/gtest.h>

#include <random>

namespace bedflow {
namespace {

// A box with walls in x and y, periodic in z, and particles everywhere, next to faces, edges and corners too.
struct Bed {
  static constexpr double volume = 1e-3;
  Decomposition decomposition;
  Grid grid;
  PhaseTimer timer;
  Halo halo;
  GasState gas;
  Exchange exchange;
  Transfer transfer;
  ParticleStore particles;

  explicit Bed(Int3 cells, int count = 400)
      : decomposition(Comm::world(), cells, {1, 2, 1.5}, {false, false, true}, -1, {2, 2, 1}),
        grid(decomposition, 2),
        halo(decomposition, grid, timer),
        gas(grid),
        exchange(grid),
        transfer(decomposition, grid, halo, volume, 0.35, timer) {
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

TEST(Transfer, DepositedVolumeIsTheParticlesVolumeNextToWallsAndCornersToo) {
  Bed bed({5, 8, 4});
  EXPECT_EQ(bed.transfer.deposit_volume(bed.particles, bed.gas.fraction), 0);
  double solids = 0;
  bed.each_cell([&](int i, int j, int k) { solids += (1 - bed.gas.fraction(i, j, k)) * bed.grid.cell_volume(); });
  EXPECT_NEAR(bed.decomposition.comm().sum(solids) / (400 * Bed::volume), 1, 1e-13);  // round-off of 400 sums
}

TEST(Transfer, WhatTheFloorHidesIsCounted) {
  Bed bed({5, 8, 4});
  ParticleStore heap;
  const Vec3 place{0.5, 1, 0.7};
  if (bed.decomposition.owner(place) == bed.decomposition.comm().rank())
    for (int p = 0; p < 300; ++p) heap.add(p, place, {}, {});
  const double hidden = bed.transfer.deposit_volume(heap, bed.gas.fraction);
  double solids = 0;
  bed.each_cell([&](int i, int j, int k) { solids += (1 - bed.gas.fraction(i, j, k)) * bed.grid.cell_volume(); });
  EXPECT_GT(hidden, 0);
  EXPECT_NEAR((bed.decomposition.comm().sum(solids) + hidden) / (300 * Bed::volume), 1, 1e-13);
}

TEST(Transfer, BoverAllFacesIsTheSumOverParticles) {
  Bed bed({5, 8, 4});
  bed.transfer.deposit_volume(bed.particles, bed.gas.fraction);
  bed.transfer.deposit_drag(ConstantDrag{0.25}, {}, bed.particles, bed.gas, bed.exchange);
  for (int d = 0; d < 3; ++d) {
    const auto node = [&](int face) {  // cells that the face stands for
      const int global = bed.grid.first[d] + face, n = bed.grid.global[d];
      if (d == 2) return 1.0;
      return global == 0 ? 0.0 : 1 + 0.5 * (global == 1) + 0.5 * (global == n - 1);
    };
    std::array<double, 4> sums{};  // b, bV, volume by faces; bV by particles
    bed.each_cell([&](int i, int j, int k) {
      const double share = node(d == 0 ? i : d == 1 ? j : k);
      sums[0] += share * bed.exchange.drag[d](i, j, k);
      sums[1] += share * bed.exchange.drag_momentum[d](i, j, k);
      sums[2] += share * bed.exchange.buoyancy[d](i, j, k) * bed.grid.cell_volume();
    });
    for (std::size_t p = 0; p < bed.particles.owned; ++p) sums[3] += 0.25 * bed.particles.velocity(p)[d];
    bed.decomposition.comm().sum(sums);
    EXPECT_NEAR(sums[0] / (400 * 0.25), 1, 1e-13);
    EXPECT_NEAR(sums[1], sums[3], 1e-13 * 100);  // 400 terms of up to 0.125
    EXPECT_NEAR(sums[2] / (400 * Bed::volume), 1, 1e-13);
  }
}

TEST(Transfer, WhatTheGasLosesTheParticlesReceive) {
  for (const Int3 cells : {Int3{5, 8, 4}, Int3{4, 4, 1}, Int3{2, 6, 3}}) {
    if (cells != Int3{5, 8, 4} && Comm::world().size() > 1) continue;  // too few cells to share
    Bed bed(cells);
    bed.transfer.deposit_volume(bed.particles, bed.gas.fraction);
    bed.stir_gas();
    bed.transfer.deposit_drag(GidaspowBlended{}, {1.2, 1.8e-5, 0.1}, bed.particles, bed.gas, bed.exchange);
    bed.stir_gas();
    bed.transfer.sample(bed.gas, bed.particles);
    const ExchangeBalance balance = bed.transfer.balance(bed.gas, bed.exchange, bed.particles);
    for (int d = 0; d < 3; ++d) {
      EXPECT_GT(balance.scale[d], 0);
      EXPECT_NEAR(balance.lost_by_gas[d], balance.received_by_particles[d], 1e-14 * balance.scale[d]);
    }
  }
}

TEST(Transfer, ConstantsAreReproducedNextToWallsToo) {
  Bed bed({5, 8, 4});
  bed.gas.fraction.fill(0.4);
  for (int d = 0; d < 3; ++d) bed.gas.velocity[d].fill(3.0 + d);
  bed.transfer.deposit_drag(ConstantDrag{1}, {}, bed.particles, bed.gas, bed.exchange);
  bed.transfer.sample(bed.gas, bed.particles);
  for (std::size_t p = 0; p < bed.particles.owned; ++p) {
    EXPECT_NEAR(bed.transfer.at(bed.gas.fraction, bed.particles.position(p)), 0.4, 1e-15);
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(bed.particles.gas_force[p][d] + bed.particles.velocity(p)[d], 3.0 + d, 1e-14);
  }
}

// A linear pressure gives every particle 𝒱 times its slope, also in the half cell next to a wall.
TEST(Transfer, AUniformPressureGradientPushesEveryParticleAlike) {
  Bed bed({5, 8, 4});
  bed.each_cell(
      [&](int i, int j, int k) { bed.gas.pressure(i, j, k) = -50 * (bed.grid.first[1] + j) * bed.grid.spacing.y + 0 * (i + k); });
  bed.halo.fill(bed.gas.pressure);
  bed.transfer.deposit_volume(bed.particles, bed.gas.fraction);
  bed.transfer.deposit_drag(ConstantDrag{0}, {}, bed.particles, bed.gas, bed.exchange);
  bed.transfer.sample(bed.gas, bed.particles);
  for (std::size_t p = 0; p < bed.particles.owned; ++p) {
    EXPECT_NEAR(bed.particles.gas_force[p].y / (50 * Bed::volume), 1, 1e-12);  // differences of pressures of up to 100 Pa
    EXPECT_EQ(bed.particles.gas_force[p].x, 0);
  }
}

TEST(Hat, SharesAreAtLeastZeroAndSumToOneFoldedOrNot) {
  for (double s = -1.3; s < 6; s += 0.1) {
    const Stencil stencil = Hat::along(s, 0, 4);
    EXPECT_NEAR(stencil.weight[0] + stencil.weight[1], 1, 1e-15);
    EXPECT_GE(stencil.weight[0], 0);
    EXPECT_GE(stencil.weight[1], 0);
    EXPECT_TRUE(stencil.index[0] >= 0 && stencil.index[1] <= 4);
    const double middle = stencil.index[0] * stencil.weight[0] + stencil.index[1] * stencil.weight[1];
    EXPECT_NEAR(middle, std::clamp(s, 0.0, 4.0), 1e-14);
  }
}

}  // namespace
}  // namespace bedflow
