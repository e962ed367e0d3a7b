#include <gtest/gtest.h>

#include <numbers>
#include <numeric>
#include <random>

#include "support/transfer_bed.h"

namespace bedflow {
namespace {

// Every kernel, the DPVM with cells from wider than its cube to narrower than the particle.
template <class Take>
void each_kernel(Take take) {
  const Int3 cells{8, 12, 6};  // of 0.125, 0.167, 0.25
  take(Bed(cells, 400, Hat{}), "hat");
  take(Bed(cells, 400, Garg{}), "garg");
  take(Bed(cells, 400, SquareDpvm{}, 0.08), "dpvm, 2 points");
  take(Bed(cells, 400, SquareDpvm{}, 0.15), "dpvm, 3 points");
  take(Bed(cells, 400, SquareDpvm{1.5, true}, 0.15), "dpvm of caps, 3 points");
  take(Bed(cells, 400, SquareDpvm{}, 0.2), "dpvm, 4 points");
  take(Bed(cells, 400, Gaussian{}, 0.2), "gaussian");
}

TEST(Transfer, DepositedVolumeIsTheParticlesVolumeNextToWallsAndCornersToo) {
  each_kernel([](Bed bed, const char* name) {
    EXPECT_EQ(bed.transfer.deposit_volume(bed.particles, bed.gas.fraction), 0) << name;
    double solids = 0;
    bed.each_cell([&](int i, int j, int k) { solids += (1 - bed.gas.fraction(i, j, k)) * bed.grid.cell_volume(); });
    EXPECT_NEAR(bed.decomposition.comm().sum(solids) / (400 * Bed::volume), 1, 1e-13) << name;  // round-off of 400 sums
  });
}

// Types and sizes of their own: each particle fills its own volume, drags by the law at its own diameter, floats by its own
// volume.
TEST(Transfer, EachParticleActsByItsOwnSize) {
  Bed bed({8, 12, 6});
  const std::vector<double> of_type{0.05, 0.08};
  Transfer transfer(bed.decomposition, bed.grid, bed.halo,
                    {.diameter = 0.08, .fraction_floor = 0.01, .types = {{0.025, 900, false}, {0.04, 2500, false}}}, bed.timer);
  const auto sphere = [](double d) { return std::numbers::pi / 6 * d * d * d; };
  for (const bool distributed : {false, true}) {
    std::vector<double> diameters;
    bed.particles.type.clear();
    bed.particles.radius.clear();
    for (std::size_t p = 0; p < bed.particles.owned; ++p) {
      bed.particles.type.push_back(static_cast<std::uint8_t>(bed.particles.id[p] % 2));
      diameters.push_back(distributed ? 0.04 + 1e-4 * static_cast<double>(bed.particles.id[p]) : of_type[bed.particles.type[p]]);
      if (distributed) bed.particles.radius.push_back(diameters[p] / 2);
    }
    bed.stir_gas();
    transfer.deposit_volume(bed.particles, bed.gas.fraction);
    double solids = 0, volume = 0, drag = 0, b = 0;
    bed.each_cell([&](int i, int j, int k) { solids += (1 - bed.gas.fraction(i, j, k)) * bed.grid.cell_volume(); });
    for (const double d : diameters) volume += sphere(d);
    const Comm& comm = bed.decomposition.comm();
    EXPECT_NEAR(comm.sum(solids) / comm.sum(volume), 1, 1e-12);
    // At rest in clear gas Wen & Yu's b is Stokes' 3πμd (times ε^-2.65, which is 1 within the solids' own share).
    for (int d = 0; d < 3; ++d) bed.gas.velocity[d].fill(0);
    for (std::size_t p = 0; p < bed.particles.owned; ++p) bed.particles.velocity(p) = {};
    bed.gas.fraction.fill(1);
    transfer.find_drag(WenYu{}, {1.2, 1.8e-5, 0.08}, bed.particles, bed.gas);
    transfer.deposit_drag(bed.particles, {}, bed.exchange);
    for (const double d : diameters) b += 3 * std::numbers::pi * 1.8e-5 * d;
    bed.each_cell([&](int i, int j, int k) { drag += bed.exchange.drag[2](i, j, k); });  // z is periodic: all faces are inside
    EXPECT_NEAR(comm.sum(drag) / comm.sum(b), 1, 1e-12);
    transfer.sample(bed.gas, bed.particles);
    const ExchangeBalance balance = transfer.balance(bed.gas, bed.exchange, bed.particles);
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(balance.lost_by_gas[d], balance.received_by_particles[d], 1e-12 * balance.scale[d]);
  }
}

TEST(Transfer, WhatTheFloorHidesIsCounted) {
  Bed bed({5, 8, 4});
  ParticleStore heap;
  const Vec3 place{0.5, 1.02, 0.7};
  for (int p = 0; p < 300; ++p)
    if (bed.decomposition.owner(place) == bed.decomposition.comm().rank()) heap.add(p, place, {}, {});
  const double hidden = bed.decomposition.comm().sum(bed.transfer.deposit_volume(heap, bed.gas.fraction));
  double solids = 0;
  bed.each_cell([&](int i, int j, int k) { solids += (1 - bed.gas.fraction(i, j, k)) * bed.grid.cell_volume(); });
  EXPECT_GT(hidden, 0);
  const Transfer::Lowest lowest = bed.transfer.lowest();  // before the floor: the heap fills its cell many times over
  const double smallest = bed.decomposition.comm().min(lowest.fraction);
  EXPECT_LT(smallest, -1);
  if (lowest.fraction == smallest) {
    EXPECT_EQ(bed.grid.first[0] + lowest.cell[0], bed.decomposition.cell_of(0, place.x));
    EXPECT_EQ(bed.grid.first[1] + lowest.cell[1], bed.decomposition.cell_of(1, place.y));
    EXPECT_EQ(bed.grid.first[2] + lowest.cell[2], bed.decomposition.cell_of(2, place.z));
  }
  EXPECT_NEAR((bed.decomposition.comm().sum(solids) + hidden) / (300 * Bed::volume), 1, 1e-13);
}

TEST(Transfer, BoverAllFacesIsTheSumOverParticles) {
  each_kernel([](Bed bed, const char* name) {
    bed.transfer.deposit_volume(bed.particles, bed.gas.fraction);
    bed.transfer.find_drag(ConstantDrag{0.25}, {}, bed.particles, bed.gas);
    bed.transfer.deposit_drag(bed.particles, {}, bed.exchange);
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
      EXPECT_NEAR(sums[0] / (400 * 0.25), 1, 1e-13) << name;
      EXPECT_NEAR(sums[1], sums[3], 1e-13 * 100) << name;  // 400 terms of up to 0.125
      EXPECT_NEAR(sums[2] / (400 * Bed::volume), 1, 1e-13) << name;
    }
  });
}

void expect_closed(Bed& bed, const char* name) {
  bed.transfer.deposit_volume(bed.particles, bed.gas.fraction);
  bed.stir_gas();
  bed.transfer.find_drag(GidaspowBlended{}, {1.2, 1.8e-5, 0.1}, bed.particles, bed.gas);
  bed.transfer.deposit_drag(bed.particles, {}, bed.exchange);
  bed.stir_gas();
  bed.transfer.sample(bed.gas, bed.particles);
  const ExchangeBalance balance = bed.transfer.balance(bed.gas, bed.exchange, bed.particles);
  for (int d = 0; d < 3; ++d) {
    EXPECT_GT(balance.scale[d], 0) << name;
    EXPECT_NEAR(balance.lost_by_gas[d], balance.received_by_particles[d], 1e-14 * balance.scale[d]) << name;
  }
}

TEST(Transfer, WhatTheGasLosesTheParticlesReceive) {
  each_kernel([](Bed bed, const char* name) { expect_closed(bed, name); });
  if (Comm::world().size() > 1) return;  // too few cells to share
  for (const Int3 cells : {Int3{4, 4, 1}, Int3{2, 6, 3}}) {
    Bed narrow(cells);
    expect_closed(narrow, "narrow box");
    Bed narrower(cells, 400, SquareDpvm{}, 1.1 / cells[0]);
    expect_closed(narrower, "narrow box, wide kernel");
    Bed smooth(cells, 400, Gaussian{}, 1.1 / cells[0]);
    expect_closed(smooth, "narrow box, gaussian");
  }
}

// One particle alone: Σ over faces of (deposited b) U is b times the U that it samples, wherever it stands.
TEST(Transfer, DepositIsTheTransposeOfInterpolation) {
  if (Comm::world().size() > 1) return;
  each_kernel([](Bed bed, const char* name) {
    const ParticleStore all = bed.particles;
    for (std::size_t p = 0; p < 40; ++p) {
      bed.particles = {};
      bed.particles.add(0, all.position(p), {}, {});
      bed.particles.gas_force.resize(1);
      expect_closed(bed, name);
    }
  });
}

TEST(Transfer, ConstantsAreReproducedNextToWallsToo) {
  each_kernel([](Bed bed, const char* name) {
    bed.transfer.deposit_volume(bed.particles, bed.gas.fraction);
    bed.gas.fraction.fill(0.4);
    for (int d = 0; d < 3; ++d) bed.gas.velocity[d].fill(3.0 + d);
    // Without density Ergun's b is 25π μ d (1 − ε)/ε: it tells ε.
    bed.transfer.find_drag(Ergun{}, {0, 1 / (25 * std::numbers::pi), 1}, bed.particles, bed.gas);
    bed.transfer.deposit_drag(bed.particles, {}, bed.exchange);
    bed.transfer.sample(bed.gas, bed.particles);
    for (std::size_t p = 0; p < bed.particles.owned; ++p)
      for (int d = 0; d < 3; ++d)
        EXPECT_NEAR(bed.particles.gas_force[p][d], 1.5 * (3.0 + d - bed.particles.velocity(p)[d]), 3e-14) << name;
  });
}

// A linear pressure gives every particle 𝒱 times its slope, also in the half cell next to a wall.
TEST(Transfer, AUniformPressureGradientPushesEveryParticleAlike) {
  each_kernel([](Bed bed, const char* name) {
    bed.each_cell([&](int i, int j, int k) {
      bed.gas.pressure(i, j, k) = -50 * (bed.grid.first[1] + j) * bed.grid.spacing.y + 0 * (i + k);
    });
    bed.halo.fill(bed.gas.pressure);
    bed.transfer.deposit_volume(bed.particles, bed.gas.fraction);
    bed.transfer.find_drag(ConstantDrag{0}, {}, bed.particles, bed.gas);
    bed.transfer.deposit_drag(bed.particles, {}, bed.exchange);
    bed.transfer.sample(bed.gas, bed.particles);
    for (std::size_t p = 0; p < bed.particles.owned; ++p) {
      EXPECT_NEAR(bed.particles.gas_force[p].y / (50 * Bed::volume), 1, 1e-12) << name;  // differences of up to 100 Pa
      EXPECT_EQ(bed.particles.gas_force[p].x, 0);
    }
  });
}

// U = sin y, sampled by particles at rest with b = 1 far from walls. The largest error of all.
double interpolation_error(const Kernel& kernel, int cells, double diameter) {
  const Decomposition decomposition(Comm::self(), {cells, cells, cells}, {1, 1, 1}, {true, true, true});
  const Grid grid(decomposition, kernel_ghosts(kernel, diameter, {1.0 / cells, 1.0 / cells, 1.0 / cells}, 0, true));
  PhaseTimer timer;
  Halo halo(decomposition, grid, timer);
  GasState gas(grid);
  Exchange exchange(grid);
  Transfer transfer(decomposition, grid, halo, {.kernel = kernel, .diameter = diameter}, timer);
  const auto wave = [](double x) { return std::sin(2 * std::numbers::pi * x); };
  for (int k = 0; k < cells; ++k)
    for (int j = 0; j < cells; ++j)
      for (int i = 0; i < cells; ++i) gas.velocity[0](i, j, k) = wave(i * grid.spacing.x);
  halo.fill(gas.velocity);
  ParticleStore particles;
  for (int p = 0; p < 200; ++p) particles.add(p, {std::fmod(0.1 + p * 0.6180339887, 1), 0.5, 0.5}, {}, {});
  particles.gas_force.resize(200);
  transfer.deposit_volume(particles, gas.fraction);
  transfer.find_drag(ConstantDrag{1}, {}, particles, gas);
  transfer.deposit_drag(particles, {}, exchange);
  transfer.sample(gas, particles);
  double worst = 0;
  for (std::size_t p = 0; p < 200; ++p)
    worst = std::max(worst, std::abs(particles.gas_force[p].x - wave(particles.position(p).x)));
  return worst;
}

TEST(Transfer, TheHatInterpolatesToSecondOrderAndTheDpvmToFirst) {
  if (Comm::world().size() > 1) return;
  const double hat = std::log2(interpolation_error(Hat{}, 16, 0.01) / interpolation_error(Hat{}, 32, 0.01));
  EXPECT_NEAR(hat, 2, 0.1);
  // A cube of half a cell's edge in each: the particle's diameter shrinks with the cells.
  const double dpvm =
      std::log2(interpolation_error(SquareDpvm{}, 16, 1.0 / 48) / interpolation_error(SquareDpvm{}, 32, 1.0 / 96));
  EXPECT_NEAR(dpvm, 1, 0.1);
}

// ---------------------------------------------------------------------------------------------------- kernels by themselves

// ε around one particle in the middle of a box, as solids volumes of the cells along x.
struct Lump {
  std::vector<double> solids;  // of each plane of cells, m³
  double mean = 0, variance = 0;
};
Lump lump(const Kernel& kernel, double diameter, int cells, Vec3 place) {
  const Decomposition decomposition(Comm::self(), {cells, cells, cells}, {1, 1, 1}, {false, false, false});
  const Grid grid(decomposition, std::max(1, kernel_points(kernel, diameter, {1.0 / cells, 1.0 / cells, 1.0 / cells}) - 1));
  PhaseTimer timer;
  Halo halo(decomposition, grid, timer);
  Field fraction(grid);
  const double volume = 1e-7;
  Transfer transfer(decomposition, grid, halo, {.kernel = kernel, .diameter = diameter, .particle_volume = volume}, timer);
  ParticleStore one;
  one.add(0, place, {}, {});
  transfer.deposit_volume(one, fraction);
  Lump result;
  for (int i = 0; i < cells; ++i) {
    double solids = 0;
    for (int k = 0; k < cells; ++k)
      for (int j = 0; j < cells; ++j) solids += (1 - fraction(i, j, k)) * grid.cell_volume() / volume;
    result.solids.push_back(solids);
    result.mean += solids * (i + 0.5) / cells;
    result.variance += solids * std::pow((i + 0.5) / cells - place.x, 2);
  }
  return result;
}

// The hat's variance in a cell is f (1 − f) h² with f the place between centres: h²/6 over all places, which the diffusion counts
// on.
TEST(Gaussian, HasItsOwnWidthWhateverTheCells) {
  if (Comm::world().size() > 1) return;
  const double diameter = 0.06, sigma = 3 * diameter / 2.3548200450309493;
  for (const int cells : {12, 20, 40}) {  // from wider than a particle to less than half of one
    double variance = 0;
    const int places = 8;
    for (int p = 0; p < places; ++p) {
      const Lump at = lump(Gaussian{}, diameter, cells, {0.5 + (p + 0.5) / places / cells, 0.5, 0.5});
      EXPECT_NEAR(at.mean, 0.5 + (p + 0.5) / places / cells, 1e-6) << cells;  // the tail that a wall 6 σ away turns back
      variance += at.variance / places;
      for (const double solids : at.solids) EXPECT_GE(solids, -1e-9);  // 1 − ε of a volume of 1e-7: digits that are left
    }
    // Midpoint sum of f (1 − f) over 8 places: 1/6 + 1/(12·64).
    EXPECT_NEAR(variance, sigma * sigma + 1.0 / (12 * 64 * cells * cells), 1e-6) << cells;
  }
}

TEST(Gaussian, TendsToTheGaussianToSecondOrder) {
  if (Comm::world().size() > 1) return;
  const double diameter = 0.06, sigma = 3 * diameter / 2.3548200450309493;
  std::array<double, 2> error{};
  for (const int level : {0, 1}) {
    const int cells = level == 0 ? 20 : 40;
    const Lump at = lump(Gaussian{}, diameter, cells, {0.5, 0.5, 0.5});
    for (int i = 0; i < cells; ++i) {
      const auto below = [&](double x) { return 0.5 * std::erf((x - 0.5) / (sigma * std::sqrt(2))); };
      error[level] += std::abs(at.solids[i] - below((i + 1.0) / cells) + below(static_cast<double>(i) / cells));
    }
  }
  EXPECT_GT(std::log2(error[0] / error[1]), 1.8) << error[0] << " " << error[1];
}

TEST(SquareDpvm, SharesAreThePartsOfTheCubeInEachCell) {
  if (Comm::world().size() > 1) return;
  const double diameter = 0.11, half = 0.75 * diameter;  // over three cells of 0.1
  for (const double x : {0.43, 0.5, 0.551}) {
    const Lump at = lump(SquareDpvm{}, diameter, 10, {x, 0.5, 0.5});
    for (int i = 0; i < 10; ++i) {
      const double part = std::max(0.0, std::min(x + half, (i + 1) * 0.1) - std::max(x - half, i * 0.1)) / (2 * half);
      EXPECT_NEAR(at.solids[i], part, 1e-8) << x << " " << i;
    }
  }
}

TEST(SquareDpvm, CapsAreThoseOfTheBall) {
  if (Comm::world().size() > 1) return;
  const double diameter = 0.06, a = 0.75 * diameter;  // within two cells of 0.1
  const Lump at = lump(SquareDpvm{1.5, true}, diameter, 10, {0.47, 0.5, 0.5});
  const double h = a - 0.03;  // to the face at 0.5
  EXPECT_NEAR(at.solids[5], h * h * (3 * a - h) / (4 * a * a * a), 1e-8);
  EXPECT_NEAR(at.solids[4], 1 - h * h * (3 * a - h) / (4 * a * a * a), 1e-8);
}

TEST(Kernel, SharesAreAtLeastZeroAndSumToOne) {
  for (const Kernel& kernel : {Kernel(Hat{}), Kernel(SquareDpvm{}), Kernel(SquareDpvm{1.5, true}), Kernel(SquareDpvm{3, false})})
    for (const double diameters : {0.05, 0.6, 0.66666, 1.0, 1.9})
      std::visit(
          [&](const auto& law) {
            const int points = law.points_for(diameters);
            for (double s = -1.3; s < 6; s += 0.013) {
              std::vector<double> share(points);
              const int first = law.along(s, diameters, share.data(), points);
              EXPECT_NEAR(std::accumulate(share.begin(), share.end(), 0.0), 1, 1e-15) << law.name << " " << s;
              for (const double one : share) EXPECT_GE(one, 0);
              double middle = 0;
              for (int q = 0; q < points; ++q) middle += share[q] * (first + q);
              EXPECT_NEAR(middle, s, 0.5) << law.name;
            }
          },
          kernel);
}

}  // namespace
}  // namespace bedflow
