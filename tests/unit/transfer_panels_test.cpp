// Particles beside rectangles inside the box: what they give to the grid stays on their side.
#include <gtest/gtest.h>

#include "gas/panels.h"
#include "support/transfer_bed.h"

namespace bedflow {
namespace {

// Panels across half the bed or the whole of it, 10/12 of a metre up; the gas is at rest on what they close.
struct Fenced {
  static constexpr double height = 5 * 2.0 / 12;
  Fenced(Bed& given, double width, const std::variant<Baffle, Plate>& kind)
      : bed(given),
        panel{{0, height, 0}, {width, height, 1.5}, kind},
        transfer(bed.decomposition, bed.grid, bed.halo,
                 {.kernel = bed.kernel,
                  .diameter = bed.diameter,
                  .particle_volume = Bed::volume,
                  .fraction_floor = 0.01,
                  .panels = {panel}},
                 bed.timer),
        boundaries(bed.decomposition, bed.grid, {}),
        panels(bed.grid, bed.decomposition, boundaries, {panel}) {}
  // Volume to the grid, drag there and back through any gas.
  void exchange() {
    bed.stir_gas();
    transfer.deposit_volume(bed.particles, bed.gas.fraction);
    panels.close(bed.gas.velocity);
    panels.set_jumps(bed.gas, bed.grid, 1.2);
    for (int d = 0; d < 3; ++d) bed.halo.fill(bed.gas.velocity[d]);
    transfer.find_drag(ConstantDrag{0.3}, {1.2, 1.8e-5, bed.diameter}, bed.particles, bed.gas);
    transfer.deposit_drag(bed.particles, {}, bed.exchange);
    transfer.sample(bed.gas, bed.particles);
  }
  Bed& bed;
  Panel panel;
  Transfer transfer;
  Boundaries boundaries;
  Panels panels;
};

const Kernel narrow_kernels[] = {Hat{}, SquareDpvm{}};

TEST(TransferBesidePanels, NothingIsFoundBehindThem) {
  for (const Kernel& kernel : narrow_kernels)
    for (const bool closed : {true, false}) {
      Bed bed({8, 12, 6}, 400, kernel, 0.1);
      ParticleStore above;
      for (std::size_t p = 0; p < bed.particles.owned; ++p)
        if (bed.particles.position(p).y > Fenced::height)
          above.add(bed.particles.id[p], bed.particles.position(p), bed.particles.velocity(p), {});
      above.gas_force.resize(above.owned);
      bed.particles = above;
      Fenced fenced(bed, 1, closed ? std::variant<Baffle, Plate>(Baffle{}) : Plate{5, 0});
      fenced.exchange();
      double solids = 0, drag = 0, beside = 0, on_panel = 0;
      bed.each_cell([&](int i, int j, int k) {
        const int y = bed.grid.first[1] + j;
        solids += 1 - bed.gas.fraction(i, j, k);
        drag += bed.exchange.drag[2](i, j, k);
        beside += y == 5 ? 1 - bed.gas.fraction(i, j, k) : 0;
        on_panel += y == 5 ? bed.exchange.drag[1](i, j, k) : 0;
        if (y >= 5) return;
        EXPECT_EQ(bed.gas.fraction(i, j, k), 1);
        for (int d = 0; d < 3; ++d) EXPECT_EQ(bed.exchange.drag[d](i, j, k), 0) << d << " " << y;
      });
      const Comm& comm = bed.decomposition.comm();
      EXPECT_GT(comm.sum(beside), 0);
      EXPECT_EQ(comm.sum(on_panel) == 0, closed);  // gas goes through a plate, and is dragged in it
      const double count = static_cast<double>(comm.sum(static_cast<std::int64_t>(above.owned)));
      EXPECT_NEAR(comm.sum(solids) * bed.grid.cell_volume() / (count * Bed::volume), 1, 1e-13);  // round-off
      EXPECT_NEAR(comm.sum(drag) / (0.3 * count), 1, 1e-13);
    }
}

// Whatever is around the rim: a baffle takes what its closed faces would.
TEST(TransferBesidePanels, WhatGasAndPanelLoseTheParticlesReceive) {
  for (const Kernel& kernel : narrow_kernels)
    for (const bool closed : {true, false}) {
      Bed bed({8, 12, 6}, 400, kernel, 0.1);
      Fenced fenced(bed, 0.5, closed ? std::variant<Baffle, Plate>(Baffle{}) : Plate{5, 2});
      fenced.exchange();
      const ExchangeBalance balance = fenced.transfer.balance(bed.gas, bed.exchange, bed.particles);
      for (int d = 0; d < 3; ++d) EXPECT_NEAR(balance.lost_by_gas[d], balance.received_by_particles[d], 1e-13 * balance.scale[d]);
    }
}

}  // namespace
}  // namespace bedflow
