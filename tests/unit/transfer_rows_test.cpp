// What the transfer leaves out where there are no particles changes no bit of what it gives.
#include <gtest/gtest.h>

#include <random>

#include "coupling/transfer.h"

namespace bedflow {
namespace {

constexpr Vec3 box{1, 4, 1.5};
constexpr Int3 cells{8, 24, 6};

// 60 particles in a cube around a place, some on the faces of the box where it reaches beyond them.
ParticleStore cluster(Vec3 place) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> share(-0.25, 0.25);
  ParticleStore particles;
  for (int p = 0; p < 60; ++p) {
    Vec3 x = place + Vec3{share(random), share(random), share(random)};
    for (int d = 0; d < 3; ++d) x[d] = std::clamp(x[d], 0.0, box[d]);
    particles.add(p, x, {share(random), share(random), share(random)}, {});
  }
  particles.gas_force.resize(particles.owned);
  return particles;
}

void expect_same(const Grid& grid, const FaceField& one, const FaceField& other, const std::string& where) {
  for (int d = 0; d < 3; ++d)
    for (int k = 0; k < grid.cells[2]; ++k)
      for (int j = 0; j < grid.cells[1]; ++j)
        for (int i = 0; i < grid.cells[0]; ++i)
          ASSERT_EQ(one[d](i, j, k), other[d](i, j, k)) << where << " " << d << ": " << i << " " << j << " " << k;
}

// The one knows the rows from the deposit of volume, the other, which is told the places once more, takes all. A cluster that
// jumps through the box leaves rows behind.
TEST(RowsInUse, AreAllThatParticlesHaveSharesOf) {
  const std::pair<Kernel, double> kernels[] = {{Hat{}, 0.08}, {Garg{}, 0.08}, {SquareDpvm{}, 0.15}, {SquareDpvm{1.5, true}, 0.2}};
  for (const auto& [kernel, diameter] : kernels) {
    const Decomposition decomposition(Comm::self(), cells, box, {false, false, false});
    const Vec3 spacing{box.x / cells[0], box.y / cells[1], box.z / cells[2]};
    const Grid grid(decomposition, kernel_ghosts(kernel, diameter, spacing, 0, true));
    PhaseTimer timer;
    Halo halo(decomposition, grid, timer);
    const TransferSetup setup{.kernel = kernel, .diameter = diameter, .particle_volume = 5e-4};
    Transfer sparse(decomposition, grid, halo, setup, timer), all(decomposition, grid, halo, setup, timer);
    GasState gas(grid);
    for (int k = 0; k < cells[2]; ++k)
      for (int j = 0; j < cells[1]; ++j)
        for (int i = 0; i < cells[0]; ++i) {
          gas.pressure(i, j, k) = 100 * std::cos(2.0 * i + 3 * j + k);
          for (int d = 0; d < 3; ++d) gas.velocity[d](i, j, k) = std::sin(1.0 + d + 3 * i + 5 * j + 7 * k);
        }
    Exchange of_sparse(grid), of_all(grid);
    for (const Vec3 place : {Vec3{0.1, 0.1, 0.1}, Vec3{0.5, 1.9, 0.8}, Vec3{0.95, 3.9, 1.4}, Vec3{0.5, 2.3, 0.2}}) {
      ParticleStore one = cluster(place), other = one;
      Field fraction(grid);
      sparse.deposit_volume(one, gas.fraction);
      all.deposit_volume(other, fraction);
      all.locate(other);
      for (Transfer* transfer : {&sparse, &all}) {
        const bool first = transfer == &sparse;
        transfer->find_drag(WenYu{}, {1.2, 1.8e-5, diameter}, first ? one : other, gas);
        transfer->deposit_drag(first ? one : other, {1e-3, 20}, first ? of_sparse : of_all);
        transfer->sample(gas, first ? one : other);
      }
      expect_same(grid, of_sparse.drag, of_all.drag, "drag");
      expect_same(grid, of_sparse.drag_momentum, of_all.drag_momentum, "momentum");
      expect_same(grid, of_sparse.buoyancy, of_all.buoyancy, "buoyancy");
      for (std::size_t p = 0; p < one.owned; ++p)
        for (int d = 0; d < 3; ++d) ASSERT_EQ(one.gas_force[p][d], other.gas_force[p][d]) << p;
    }
  }
}

}  // namespace
}  // namespace bedflow
