// Where the particles stand on the lattices of the grid: found once a step, used by every sweep of the transfer.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "base/check.h"
#include "coupling/fences.h"
#include "coupling/lattices.h"
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

  double sum(const Shares& shares, int lattice, const double* values) const {
    double along[points]{};
    each_row(shares, lattice, [&](std::ptrdiff_t at, double weight) {
      for (int q = 0; q < points; ++q) along[q] += weight * values[at + q];
    });
    double result = 0;
    for (int q = 0; q < points; ++q) result += x_shares(shares, lattice)[q] * along[q];
    return result;
  }

 private:
  // All shares after the first of each direction: they sum to 1. 64 bytes with two points.
  struct Row {
    double tail[2][3][points - 1];
    std::int32_t base[4];
  };

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
