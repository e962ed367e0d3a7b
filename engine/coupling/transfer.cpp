#include "coupling/transfer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/check.h"

namespace bedflow {

// Stencils of one place along each direction, on the centres and on the faces, as offsets into a field's data.
struct Transfer::Weights {
  struct Pair {
    std::ptrdiff_t offset[2];
    double weight[2];
  };
  Pair centre[3], face[3];
  std::ptrdiff_t origin;

  // Calls take(offset, weight) for the eight points of a lattice: faces of direction d, or the centres (d = -1).
  template <class Take>
  void each(int d, Take take) const {
    const Pair& px = d == 0 ? face[0] : centre[0];
    const Pair& py = d == 1 ? face[1] : centre[1];
    const Pair& pz = d == 2 ? face[2] : centre[2];
    for (int c = 0; c < 2; ++c)
      for (int b = 0; b < 2; ++b) {
        const std::ptrdiff_t row = origin + pz.offset[c] + py.offset[b];
        const double weight = pz.weight[c] * py.weight[b];
        take(row + px.offset[0], weight * px.weight[0]);
        take(row + px.offset[1], weight * px.weight[1]);
      }
  }
  double sum(int d, const double* values) const {
    double result = 0;
    each(d, [&](std::ptrdiff_t at, double weight) { result += weight * values[at]; });
    return result;
  }
};

Transfer::Transfer(const Decomposition& decomposition, const Grid& grid, Halo& halo, double particle_volume,
                   double fraction_floor, PhaseTimer& timer)
    : decomposition_(decomposition),
      grid_(grid),
      halo_(halo),
      particle_volume_(particle_volume),
      fraction_floor_(fraction_floor),
      timer_(timer),
      gradient_(grid),
      buoyancy_share_(grid, 1) {
  for (int d = 0; d < 3; ++d) {
    shares_[d].resize(grid.size());
    const bool low = decomposition.at_face(d, 0), high = decomposition.at_face(d, 1);
    lowest_cell_[d] = low ? 0 : -grid.ghosts;
    highest_cell_[d] = high ? grid.cells[d] - 1 : grid.cells[d] + grid.ghosts - 1;
    lowest_face_[d] = low ? 1 : -grid.ghosts;
    highest_face_[d] = highest_cell_[d];
  }
}

Transfer::Weights Transfer::weights(Vec3 place) const {
  Weights result;
  result.origin = grid_.index(0, 0, 0);
  for (int d = 0; d < 3; ++d) {
    const double s = (place[d] - grid_.low[d]) / grid_.spacing[d];  // in cells from the block's low corner
    CHECK(s > 0.5 - grid_.ghosts && s < grid_.cells[d] + grid_.ghosts - 0.5, d, s);
    const Stencil centre = Hat::along(s - 0.5, lowest_cell_[d], highest_cell_[d]);
    const Stencil face = has_faces(d) ? Hat::along(s, lowest_face_[d], highest_face_[d]) : Stencil{{0, 0}, {0, 0}};
    for (int side = 0; side < 2; ++side) {
      result.centre[d].offset[side] = centre.index[side] * grid_.stride(d);
      result.centre[d].weight[side] = centre.weight[side];
      result.face[d].offset[side] = face.index[side] * grid_.stride(d);
      result.face[d].weight[side] = face.weight[side];
    }
  }
  return result;
}

double Transfer::at(const Field& field, Vec3 place) const {
  return weights(place).sum(-1, field.data());
}

// A face next to a face of the box stands for the half cell beyond it too.
double Transfer::node_volume(int d, int face) const {
  double volume = 1;
  if (decomposition_.at_face(d, 0) && face == 1) volume += 0.5;
  if (decomposition_.at_face(d, 1) && face == grid_.cells[d] - 1) volume += 0.5;
  return volume;
}

// Calls take(i, j, k, node volume in cells) for every point of a face lattice that this rank owns.
template <class Take>
void Transfer::each_owned_face(int d, Take take) const {
  Int3 low{0, 0, 0}, high = grid_.cells;
  low[d] = std::max(0, lowest_face_[d]);
  high[d] = std::min(grid_.cells[d] - 1, highest_face_[d]) + 1;
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; ++j)
      for (int i = low[0]; i < high[0]; ++i) take(i, j, k, node_volume(d, d == 0 ? i : d == 1 ? j : k));
}

double Transfer::deposit_volume(const ParticleStore& particles, Field& fraction) {
  const PhaseTimer::Scope scope(timer_, Phase::deposit, particles.owned);
  fraction.fill(0);
  double* solids = fraction.data();
  const double share = particle_volume_ / grid_.cell_volume();
  for (std::size_t p = 0; p < particles.owned; ++p) {
    weights(particles.position(p)).each(-1, [&](std::ptrdiff_t at, double weight) { solids[at] += share * weight; });
  }
  halo_.add(fraction);

  double hidden = 0;
  for (int k = 0; k < grid_.cells[2]; ++k)
    for (int j = 0; j < grid_.cells[1]; ++j)
      for (int i = 0; i < grid_.cells[0]; ++i) {
        double& value = fraction(i, j, k);
        value = 1 - value;
        if (value < fraction_floor_) {
          hidden += fraction_floor_ - value;
          value = fraction_floor_;
        }
      }
  halo_.fill(fraction);

  mirror_at_faces(fraction);
  return decomposition_.comm().sum(hidden * grid_.cell_volume());
}

// x, y, z in turn, so that edges and corners follow.
void Transfer::mirror_at_faces(Field& field) const {
  const int g = grid_.ghosts;
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) {
      if (!decomposition_.at_face(d, side)) continue;
      const int inside = side == 0 ? 0 : grid_.cells[d] - 1;
      Int3 low{-g, -g, -g}, high{grid_.cells[0] + g, grid_.cells[1] + g, grid_.cells[2] + g};
      low[d] = side == 0 ? -g : grid_.cells[d];
      high[d] = low[d] + g;
      for (int k = low[2]; k < high[2]; ++k)
        for (int j = low[1]; j < high[1]; ++j)
          for (int i = low[0]; i < high[0]; ++i)
            field(i, j, k) = field(d == 0 ? inside : i, d == 1 ? inside : j, d == 2 ? inside : k);
    }
}

template <class Drag>
void Transfer::deposit_drag(const Drag& drag, const DragScene& scene, const ParticleStore& particles, const GasState& gas,
                            Exchange& exchange) {
  const PhaseTimer::Scope scope(timer_, Phase::deposit, particles.owned);
  for (auto& shares : shares_) std::fill(shares.begin(), shares.end(), Share{});
  drag_.resize(particles.owned);
  const double share = particle_volume_ / grid_.cell_volume();
  for (std::size_t p = 0; p < particles.owned; ++p) {
    const Weights at_place = weights(particles.position(p));
    const Vec3 velocity = particles.velocity(p);
    Vec3 slip;
    for (int d = 0; d < 3; ++d) slip[d] = at_place.sum(d, gas.velocity[d].data()) - velocity[d];
    const double b = drag(scene, norm(slip), at_place.sum(-1, gas.fraction.data()));
    drag_[p] = b;
    for (int d = 0; d < 3; ++d) {
      Share* shares = shares_[d].data();
      const Share whole{b, b * velocity[d], share, 0};
      at_place.each(d, [&](std::ptrdiff_t at, double weight) { shares[at] += weight * whole; });
    }
  }
  for (int d = 0; d < 3; ++d) {
    double *drags = exchange.drag[d].data(), *momenta = exchange.drag_momentum[d].data(), *solids = exchange.buoyancy[d].data();
    const Share* shares = shares_[d].data();
    for (std::size_t at = 0; at < shares_[d].size(); ++at) {
      drags[at] = shares[at][0];
      momenta[at] = shares[at][1];
      solids[at] = shares[at][2];
    }
  }
  halo_.add(exchange.drag);
  halo_.add(exchange.drag_momentum);
  halo_.add(exchange.buoyancy);

  // Per cell of the node; ∇p acts on no more solids than the floor of ε leaves room for, on both sides of the exchange.
  for (int d = 0; d < 3; ++d) {
    each_owned_face(d, [&](int i, int j, int k, double node) {
      exchange.drag[d](i, j, k) /= node;
      exchange.drag_momentum[d](i, j, k) /= node;
      double& solids = exchange.buoyancy[d](i, j, k);
      solids /= node;
      const double limited = std::min(solids, 1 - fraction_floor_);
      buoyancy_share_[d](i, j, k) = solids > limited ? limited / solids : 1;
      solids = limited;
    });
  }
  halo_.fill(exchange.drag);
  halo_.fill(exchange.drag_momentum);
  halo_.fill(exchange.buoyancy);
}

template void Transfer::deposit_drag(const GidaspowBlended&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const Gidaspow&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const WenYu&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const Ergun&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const SchillerNaumann&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const DiFelice&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const SyamlalObrien&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const KochHill&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const Beetstra&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const Tenneti&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);
template void Transfer::deposit_drag(const ConstantDrag&, const DragScene&, const ParticleStore&, const GasState&, Exchange&);

double Transfer::pressure_gradient(const Field& pressure, int d, std::ptrdiff_t at) const {
  return (pressure.data()[at] - pressure.data()[at - grid_.stride(d)]) / grid_.spacing[d];
}

void Transfer::sample(const GasState& gas, ParticleStore& particles) {
  const PhaseTimer::Scope scope(timer_, Phase::sample, particles.owned);
  for (int d = 0; d < 3; ++d) {
    each_owned_face(d, [&](int i, int j, int k, double /*node*/) {
      gradient_[d](i, j, k) = buoyancy_share_[d](i, j, k) * pressure_gradient(gas.pressure, d, grid_.index(i, j, k));
    });
  }
  halo_.fill(gradient_);
  for (std::size_t p = 0; p < particles.owned; ++p) {
    const Weights at_place = weights(particles.position(p));
    const double b = drag_[p];
    for (int d = 0; d < 3; ++d) {
      const double* velocity = gas.velocity[d].data();
      const double* gradient = gradient_[d].data();
      double u = 0, slope = 0;
      at_place.each(d, [&](std::ptrdiff_t at, double weight) {
        u += weight * velocity[at];
        slope += weight * gradient[at];
      });
      particles.gas_force[p][d] = b * (u - particles.velocity(p)[d]) - particle_volume_ * slope;
    }
  }
}

ExchangeBalance Transfer::balance(const GasState& gas, const Exchange& exchange, const ParticleStore& particles) const {
  std::array<double, 9> sums{};  // lost x y z, received x y z, scale x y z
  for (std::size_t p = 0; p < particles.owned; ++p)
    for (int d = 0; d < 3; ++d) {
      // Without a face inside, nothing but the walls can take the particle's drag in this direction.
      if (!has_faces(d)) continue;
      sums[3 + d] += particles.gas_force[p][d];
      sums[6 + d] += std::abs(particles.gas_force[p][d]);
    }
  for (int d = 0; d < 3; ++d) {
    each_owned_face(d, [&](int i, int j, int k, double node) {
      const double drag = exchange.drag[d](i, j, k) * gas.velocity[d](i, j, k) - exchange.drag_momentum[d](i, j, k);
      const double buoyancy =
          -grid_.cell_volume() * exchange.buoyancy[d](i, j, k) * pressure_gradient(gas.pressure, d, grid_.index(i, j, k));
      sums[d] += node * (drag + buoyancy);
      sums[6 + d] += node * (std::abs(drag) + std::abs(buoyancy));
    });
  }
  decomposition_.comm().sum(sums);
  return {{sums[0], sums[1], sums[2]}, {sums[3], sums[4], sums[5]}, {sums[6], sums[7], sums[8]}};
}

}  // namespace bedflow
