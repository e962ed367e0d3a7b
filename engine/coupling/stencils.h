// Where the particles stand on the lattices of the grid: found once a step, used by every sweep of the transfer.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "base/check.h"
#include "base/simd.h"
#include "coupling/fences.h"
#include "coupling/lattices.h"
#include "models/kernel.h"
#include "particles/store.h"

namespace bedflow {

// `points` neighbours along each direction carry a particle.
template <int points>
class Stencils {
 public:
  // The shares of one particle on the centres (0) and the faces (1) of each direction.
  struct Shares {
    double along[2][3][points];
    const std::int32_t* base;  // of the first point on each lattice, in a field's data
  };

  explicit Stencils(const Grid& grid) : stride_{1, grid.stride(1), grid.stride(2)} {}

  // Shares beyond the ends of a lattice, or beyond a fence, fold onto the last points before them. Where these are fewer than
  // `points` there are shares of 0 beyond them, and there must be ghosts.
  template <class Kernel, class DiameterOf>
  void locate(const Kernel& kernel, DiameterOf diameter_of, const Grid& grid, const Lattices& lattices, const Fences& fences,
              const ParticleStore& particles) {
    rows_.resize(particles.owned);
    if constexpr (points == 2 && std::is_base_of_v<Hat, Kernel>) {
      if (fences.empty()) return locate_hats(grid, lattices, particles);
    }
    const Vec3 per_spacing{1 / grid.spacing.x, 1 / grid.spacing.y, 1 / grid.spacing.z};
    for (std::size_t p = 0; p < particles.owned; ++p) {
      Vec3 place;  // in cells
      for (int d = 0; d < 3; ++d) place[d] = (particles.position(p)[d] - grid.low[d]) * per_spacing[d];
      const double diameter = diameter_of(p);  // m
      Row& row = rows_[p];
      std::int32_t first[2][3];
      for (int d = 0; d < 3; ++d) {
        const double s = place[d], size = diameter * per_spacing[d];
        CHECK(s > 0.5 - grid.ghosts && s < grid.cells[d] + grid.ghosts - 0.5, d, s);
        for (const int faces : {0, 1}) {
          double share[points]{};
          int at = kernel.along(faces ? s : s - 0.5, size, share, points);
          int low = lattices.low(faces, d), high = lattices.high(d);
          if (!fences.empty()) fences.narrow(place, d, faces, low, high);
          if (at < low || at + points - 1 > high) at = fold(at, low, high, share);
          for (int q = 1; q < points; ++q) row.tail[faces][d][q - 1] = share[q];
          first[faces][d] = static_cast<std::int32_t>(at * stride_[d]);
        }
      }
      const auto origin = static_cast<std::int32_t>(grid.index(0, 0, 0));
      for (int lattice = 0; lattice < 4; ++lattice)
        row.base[lattice] = origin + first[lattice == 0][0] + first[lattice == 1][1] + first[lattice == 2][2];
    }
  }

  std::size_t size() const { return rows_.size(); }
  Shares operator[](std::size_t p) const {
    const Row& row = rows_[p];
    Shares shares;
    for (int faces = 0; faces < 2; ++faces)
      for (int d = 0; d < 3; ++d) {
        double rest = 1;
        for (int q = 1; q < points; ++q) rest -= shares.along[faces][d][q] = row.tail[faces][d][q - 1];
        shares.along[faces][d][0] = rest;
      }
    shares.base = row.base;
    return shares;
  }

  // Calls take(c, w) for the rows along x of a particle's points on a lattice: `points` entries of a field's data from c on,
  // whose shares are w times x_shares().
  template <class Take>
  void each_row(const Shares& shares, int lattice, Take take) const {
    const double *y = shares.along[lattice == 1][1], *z = shares.along[lattice == 2][2];
    for (int c = 0; c < points; ++c)
      for (int b = 0; b < points; ++b) take(shares.base[lattice] + c * stride_[2] + b * stride_[1], z[c] * y[b]);
  }
  static const double* x_shares(const Shares& shares, int lattice) { return shares.along[lattice == 0][0]; }

  // `values` numbers of each of a row's points, one point after the other, in registers that are full.
  template <int values>
  class Line {
   public:
    Line() = default;
    // `one` at each point, times its share x.
    Line(const double* x, const std::array<double, values>& one) {
      for (int q = 0; q < points; ++q)
        for (int v = 0; v < values; ++v) part_[(q * values + v) / width][(q * values + v) % width] = x[q] * one[v];
    }
    // Adds weight times what stands from `from` on.
    void gather(double weight, const double* from) {
      for (int r = 0; r < registers; ++r) part_[r] += weight * load<width>(from + r * width);
    }
    // Adds weight times this to what stands from `to` on.
    void scatter(double weight, double* to) const {
      for (int r = 0; r < registers; ++r)
        *reinterpret_cast<typename PackOf<width>::unaligned*>(to + r * width) += weight * part_[r];
    }
    // Σ over the points of number v times the share x.
    double sum(const double* x, int v = 0) const {
      double result = 0;
      for (int q = 0; q < points; ++q) result += x[q] * part_[(q * values + v) / width][(q * values + v) % width];
      return result;
    }

   private:
    static constexpr int numbers = points * values;
    static constexpr int width = std::min(native_lanes, numbers & -numbers), registers = numbers / width;
    Pack<width> part_[registers]{};
  };
  // Σ over the points of a lattice, of their numbers times their shares.
  template <int values>
  Line<values> gathered(const Shares& shares, int lattice, const double* from) const {
    Line<values> line;
    each_row(shares, lattice, [&](std::ptrdiff_t at, double weight) { line.gather(weight, from + at * values); });
    return line;
  }
  double sum(const Shares& shares, int lattice, const double* values) const {
    return gathered<1>(shares, lattice, values).sum(x_shares(shares, lattice));
  }
  template <int values>
  void spread(const Shares& shares, int lattice, const std::array<double, values>& one, double* to) const {
    const Line<values> line(x_shares(shares, lattice), one);
    each_row(shares, lattice, [&](std::ptrdiff_t at, double weight) { line.scatter(weight, to + at * values); });
  }

 private:
  typedef std::int64_t Whole __attribute__((vector_size(native_lanes * sizeof(std::int64_t))));
  // All shares after the first of each direction: they sum to 1. 64 bytes with two points.
  struct Row {
    double tail[2][3][points - 1];
    std::int32_t base[4];
  };

  // The same for hats where no fence is near, a register of particles at a time: a hat whose shares fold onto the last points is
  // that of a particle which stands no further than these.
  void locate_hats(const Grid& grid, const Lattices& lattices, const ParticleStore& particles) {
    constexpr int lanes = native_lanes;
    using Real = Pack<lanes>;
    static_assert(sizeof(Row) == 8 * sizeof(double) && std::endian::native == std::endian::little);
    for (std::size_t p = 0; p < particles.owned; p += lanes) {
      const int count = static_cast<int>(std::min<std::size_t>(lanes, particles.owned - p));
      const auto columns = columns_of_eight<lanes>([&](int l, int part) {
        return load<lanes>(&particles.rows[p + static_cast<std::size_t>(std::min(l, count - 1))].position.x + part);
      });
      std::array<Real, 8> rows;
      Real first[2][3];
      for (int d = 0; d < 3; ++d) {
        const Real place = (columns[d] - grid.low[d]) * (1 / grid.spacing[d]);
        for (int l = 0; l < lanes; ++l)
          CHECK(place[l] > 0.5 - grid.ghosts && place[l] < grid.cells[d] + grid.ghosts - 0.5, d, place[l]);
        for (const int faces : {0, 1}) {
          const double low = lattices.low(faces, d), high = lattices.high(d);
          const Real s = min(broadcast<Real>(std::max(low, high)), max(broadcast<Real>(low), faces == 1 ? place : place - 0.5));
          const Real below = min(broadcast<Real>(std::max(low, high - 1)), floor(s));
          rows[3 * faces + d] = s - below;
          first[faces][d] = below * static_cast<double>(stride_[d]);
        }
      }
      const auto origin = static_cast<double>(grid.index(0, 0, 0));
      const auto base = [&](int lattice) {
        return __builtin_convertvector(origin + first[lattice == 0][0] + first[lattice == 1][1] + first[lattice == 2][2], Whole);
      };
      for (const int half : {0, 1}) rows[6 + half] = std::bit_cast<Real>(base(2 * half) | base(2 * half + 1) << 32);
      rows_of_eight<lanes>(rows, [&](int l, int part, Real values) {
        if (l < count) store(reinterpret_cast<double*>(&rows_[p + static_cast<std::size_t>(l)]) + part, values);
      });
    }
  }

  static int fold(int first, int low, int high, double* share) {
    const int at = std::max(low, std::min(first, high - points + 1));
    double folded[points]{};
    for (int q = 0; q < points; ++q) folded[std::clamp(first + q, low, std::max(low, high)) - at] += share[q];
    std::copy_n(folded, points, share);
    return at;
  }

  std::array<std::ptrdiff_t, 3> stride_;
  std::vector<Row> rows_;
};

}  // namespace bedflow
