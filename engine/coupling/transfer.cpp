#include "coupling/transfer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace bedflow {

namespace {

using AnyStencils = std::variant<Stencils<2>, Stencils<3>, Stencils<4>>;

AnyStencils stencils_for(int points, const Grid& grid) {
  CHECK(points <= most_points && (points == 2 || grid.ghosts >= points - 1), points, grid.ghosts);
  if (points == 2) return Stencils<2>(grid);
  if (points == 3) return Stencils<3>(grid);
  return Stencils<4>(grid);
}

// Whether blocks or periodic images meet at any face.
bool shared(const Decomposition& decomposition) {
  for (int d = 0; d < 3; ++d)
    if (!decomposition.at_face(d, 0) || !decomposition.at_face(d, 1)) return true;
  return false;
}

}  // namespace

int kernel_points(const Kernel& kernel, double diameter, Vec3 spacing) {
  const double diameters = diameter / std::min({spacing.x, spacing.y, spacing.z});
  return std::visit([&](const auto& law) { return law.points_for(diameters); }, kernel);
}

// A share of the face n + m, the (m + 1)th ghost, needs m ≤ ⌊reach + ½⌋ with `reach` beyond the block in cells; so does one of
// the cell −m. Without neighbours only a lattice shorter than the stencil has shares, of 0, beyond its end.
int kernel_ghosts(const Kernel& kernel, double diameter, Vec3 spacing, double skin, bool shared) {
  const double narrowest = std::min({spacing.x, spacing.y, spacing.z});
  const int beyond_end = kernel_points(kernel, diameter, spacing) - 1;
  if (!shared) return beyond_end;
  const auto* dpvm = std::get_if<SquareDpvm>(&kernel);
  const double half_width = dpvm ? 0.5 * dpvm->width * diameter : 0.5 * narrowest;
  return std::max(beyond_end, static_cast<int>(std::lround((half_width + skin / 2) / narrowest)) + 1);
}

Transfer::Transfer(const Decomposition& decomposition, const Grid& grid, Halo& halo, const TransferSetup& setup,
                   PhaseTimer& timer)
    : decomposition_(decomposition),
      grid_(grid),
      halo_(halo),
      setup_(setup),
      relaxes_(std::visit([](const auto& scheme) { return scheme.relaxes; }, setup.scheme)),
      timer_(timer),
      lattices_(decomposition, grid),
      rows_(grid, shared(decomposition) || std::holds_alternative<Gaussian>(setup.kernel) ||
                      std::visit([](const auto& scheme) { return scheme.anew; }, setup.scheme)),
      fences_(decomposition, grid, setup.panels),
      stencils_(stencils_for(kernel_points(setup.kernel, setup.diameter, grid.spacing), grid)),
      gradient_(grid),
      buoyancy_share_(grid, 1) {
  for (auto& shares : shares_) shares.resize(grid.size());
  for (auto& pulls : pulls_) pulls.resize(grid.size());
  if (const auto* gaussian = std::get_if<Gaussian>(&setup.kernel)) {
    smoothing_.emplace(grid, lattices_, halo, gaussian->deviation(setup.diameter));
    smooth_velocity_ = FaceField(grid);
  }
}

// ---------------------------------------------------------------------------------------------------- volume

void Transfer::find_sizes(const ParticleStore& particles) {
  const bool alike = particles.type.empty() && particles.radius.empty();
  const std::size_t count = alike ? 1 : particles.owned;
  sizes_.step = alike ? 0 : 1;
  sizes_.diameter.assign(count, setup_.diameter);
  sizes_.volume.assign(count, setup_.particle_volume);
  sizes_.mass.assign(count, setup_.mass);
  for (std::size_t p = 0; p < count && !alike; ++p) {
    sizes_.diameter[p] = 2 * radius_of(setup_.types, particles, p);
    sizes_.mass[p] = mass_of(setup_.types, particles, p);
    sizes_.volume[p] = sphere_volume(sizes_.diameter[p]);
  }
}

void Transfer::locate(const ParticleStore& particles) {
  find_places(particles);
  rows_.take_all();
}

void Transfer::find_places(const ParticleStore& particles) {
  find_sizes(particles);
  const auto diameter_of = [&](std::size_t p) { return sizes_.diameter_of(p); };
  std::visit(
      [&](auto& stencils, const auto& kernel) { stencils.locate(kernel, diameter_of, grid_, lattices_, fences_, particles); },
      stencils_, setup_.kernel);
}

double Transfer::deposit_volume(const ParticleStore& particles, Field& fraction) {
  const PhaseTimer::Scope scope(timer_, Phase::deposit, particles.owned);
  fraction.fill(0);
  double* solids = fraction.data();
  find_places(particles);
  std::visit(
      [&]<int points>(const Stencils<points>& stencils) {
        for (std::size_t p = 0; p < particles.owned; ++p) {
          const double share = sizes_.volume_of(p) / grid_.cell_volume();
          const auto shares = stencils[p];
          stencils.template spread<1>(shares, cell_centres, {share}, solids);
        }
      },
      stencils_);
  rows_.find(fraction);
  halo_.add(fraction);
  if (smoothing_) smoothing_->apply(fraction, cell_centres);

  double hidden = 0;
  const double floor = setup_.fraction_floor;
  lowest_ = {};
  lattices_.each_owned_row(cell_centres, [&](Int3 first, int n) {
    double* row = &fraction(first[0], first[1], first[2]);
    if (!rows_.now(row - fraction.data())) {
      std::fill_n(row, n, 1.0);
      return;
    }
    for (int i = 0; i < n; ++i) {
      const double value = 1 - row[i];
      row[i] = std::max(value, floor);
      hidden += row[i] - value;
      if (!(value >= lowest_.fraction)) lowest_ = {value, {first[0] + i, first[1], first[2]}};
    }
  });
  halo_.fill(fraction);
  mirror_at_faces(fraction);
  return hidden * grid_.cell_volume();
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
        for (int j = low[1]; j < high[1]; ++j) {
          const auto row = [&](int y, int z) { return field.data() + grid_.index(low[0], y, z); };
          if (d == 0) std::fill_n(row(j, k), g, field(inside, j, k));
          if (d != 0) std::copy_n(row(d == 1 ? inside : j, d == 2 ? inside : k), high[0] - low[0], row(j, k));
        }
    }
}

// ---------------------------------------------------------------------------------------------------- drag

const FaceField& Transfer::felt_velocity(const FaceField& velocity) {
  if (!smoothing_) return velocity;
  smooth_velocity_ = velocity;
  smoothing_->apply(smooth_velocity_);
  return smooth_velocity_;
}

// |U − V| and ε at the places of the particles.
void Transfer::slips(const ParticleStore& particles, const FaceField& velocity, const Field& fraction) {
  slip_.resize(particles.owned);
  fraction_.resize(particles.owned);
  std::visit(
      [&](const auto& stencils) {
        for (std::size_t p = 0; p < particles.owned; ++p) {
          const auto shares = stencils[p];
          Vec3 slip = -particles.velocity(p);
          for (int d = 0; d < 3; ++d)
            if (lattices_.has_faces(d)) slip[d] += stencils.sum(shares, d, velocity[d].data());
          slip_[p] = norm(slip);
          fraction_[p] = stencils.sum(shares, cell_centres, fraction.data());
        }
      },
      stencils_);
}

template <class Drag>
void Transfer::find_drag(const Drag& drag, const DragScene& scene, const ParticleStore& particles, const GasState& gas) {
  const PhaseTimer::Scope scope(timer_, Phase::deposit, particles.owned);
  slips(particles, felt_velocity(gas.velocity), gas.fraction);
  drag_.resize(particles.owned);
  const double *slip = slip_.data(), *fraction = fraction_.data();
  double* b = drag_.data();
  const double parcel = setup_.coarse_graining, number = parcel * parcel * parcel;
  if (sizes_.step == 0) {
#pragma GCC ivdep
    for (std::size_t p = 0; p < particles.owned; ++p) b[p] = number * drag(scene, slip[p], fraction[p]);
  } else {
    const double* diameter = sizes_.diameter.data();
#pragma GCC ivdep
    for (std::size_t p = 0; p < particles.owned; ++p)
      b[p] = number * drag(DragScene{scene.density, scene.viscosity, diameter[p] / parcel}, slip[p], fraction[p]);
  }
}

template void Transfer::find_drag(const GidaspowBlended&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const Gidaspow&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const WenYu&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const Ergun&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const SchillerNaumann&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const DiFelice&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const SyamlalObrien&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const KochHill&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const Beetstra&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const Tenneti&, const DragScene&, const ParticleStore&, const GasState&);
template void Transfer::find_drag(const ConstantDrag&, const DragScene&, const ParticleStore&, const GasState&);

// b, bV and buoyancy of every particle to the points around it, as the gas is to lose them.
void Transfer::spread(const ParticleStore& particles, Exchange& exchange) {
  paid_ = {};
  std::visit(
      [&]<int points>(const Stencils<points>& stencils) {
        for (std::size_t p = 0; p < particles.owned; ++p) {
          const double share = sizes_.volume_of(p) / grid_.cell_volume();
          const auto shares = stencils[p];
          const double felt = relaxes_ ? felt_[p] : 1, b = felt * drag_[p];
          Vec3 momentum = b * particles.velocity(p);
          if (relaxes_) {
            const Vec3 debt = (1 / step_.dt) * particles.gas_response[p].debt;
            momentum += (1 - felt) * sizes_.mass_of(p) * setup_.gravity - debt;
            paid_ += debt;
          }
          for (int d = 0; d < 3; ++d) {
            if (!lattices_.has_faces(d)) continue;
            stencils.template spread<4>(shares, d, {b, momentum[d], felt * share, 0}, &shares_[d].data()->drag);
          }
        }
      },
      stencils_);
  for (int d = 0; d < 3; ++d) {
    double *drags = exchange.drag[d].data(), *momenta = exchange.drag_momentum[d].data(), *solids = exchange.buoyancy[d].data();
    Share* shares = shares_[d].data();
    lattices_.each_row(d, [&](std::ptrdiff_t first, int n) {
      if (!rows_.lately(first)) return;
      for (auto at = first; at < first + n; ++at) {
        drags[at] = shares[at].drag;
        momenta[at] = shares[at].drag_momentum;
        solids[at] = shares[at].solids;
        shares[at] = Share{};
      }
    });
  }
  halo_.add(exchange.drag);
  halo_.add(exchange.drag_momentum);
  halo_.add(exchange.buoyancy);
}

// Per cell of the node. ∇p acts on no more solids than the floor of ε leaves room for, on both sides of the exchange.
void Transfer::per_node_volume(Exchange& exchange) {
  const double most = 1 - setup_.fraction_floor;
  for (int d = 0; d < 3; ++d) {
    const auto each_row = [&](auto row) {
      lattices_.each_owned_row(d, [&](Int3 first, int n) {
        const std::ptrdiff_t c = grid_.index(first[0], first[1], first[2]);
        if (!rows_.lately(c)) return;
        row(exchange.drag[d].data() + c, exchange.drag_momentum[d].data() + c, exchange.buoyancy[d].data() + c,
            buoyancy_share_[d].data() + c, lattices_.node_volume(d, first), n);
      });
    };
    each_row([](double* drag, double* momentum, double* solids, double*, Lattices::NodeVolume node, int n) {
      for (int i = 0; i < n; ++i) {
        drag[i] /= node[i];
        momentum[i] /= node[i];
        solids[i] /= node[i];
      }
    });
    if (smoothing_) {
      smoothing_->apply(exchange.drag[d], d);
      smoothing_->apply(exchange.drag_momentum[d], d);
      smoothing_->apply(exchange.buoyancy[d], d);
    }
    each_row([=](double*, double*, double* solids, double* share, Lattices::NodeVolume, int n) {
      for (int i = 0; i < n; ++i) {
        share[i] = solids[i] > most ? most / solids[i] : 1;
        solids[i] = std::min(solids[i], most);
      }
    });
  }
  halo_.fill(exchange.drag);
  halo_.fill(exchange.drag_momentum);
  halo_.fill(exchange.buoyancy);
}

void Transfer::deposit_drag(const ParticleStore& particles, const Interval& step, Exchange& exchange) {
  const PhaseTimer::Scope scope(timer_, Phase::deposit, particles.owned);
  step_ = step;
  if (relaxes_) {
    felt_.resize(particles.owned);
    std::visit(
        [&](const auto& scheme) {
          for (std::size_t p = 0; p < particles.owned; ++p)
            felt_[p] = scheme.felt(drag_[p] * step.dt / sizes_.mass_of(p), step.substeps);
        },
        setup_.scheme);
  }
  spread(particles, exchange);
  per_node_volume(exchange);
  rows_.forget();
}

// ---------------------------------------------------------------------------------------------------- back to the particles

void Transfer::sample(const GasState& gas, ParticleStore& particles) {
  const PhaseTimer::Scope scope(timer_, Phase::sample, particles.owned);
  const FaceField& velocity = felt_velocity(gas.velocity);
  for (int d = 0; d < 3; ++d) {
    double* gradient = gradient_.data();
    lattices_.each_owned_row(d, [&](Int3 first, int n) {
      const std::ptrdiff_t c = grid_.index(first[0], first[1], first[2]);
      if (!rows_.now(c)) return;
      const double* share = buoyancy_share_[d].data();
      for (auto at = c; at < c + n; ++at) gradient[at] = share[at] * gradient_at(gas, d, at);
    });
    if (smoothing_) {
      smoothing_->apply(gradient_, d);
    } else {
      halo_.fill(gradient_);
    }
    const double* u = velocity[d].data();
    Pull* pulls = pulls_[d].data();
    lattices_.each_row(d, [&, u, pulls](std::ptrdiff_t first, int n) {
      if (!rows_.now(first)) return;
      for (auto at = first; at < first + n; ++at) pulls[at] = {u[at], gradient[at]};
    });
  }
  pull(particles);
  if (relaxes_) std::visit([&](const auto& scheme) { respond(scheme, particles); }, setup_.scheme);
}

// −𝒱∇p + b (U − V) at the places of the particles.
void Transfer::pull(ParticleStore& particles) {
  std::visit(
      [&](const auto& stencils) {
        for (std::size_t p = 0; p < particles.owned; ++p) {
          const auto shares = stencils[p];
          const double b = drag_[p];
          for (int d = 0; d < 3; ++d) {
            double u = 0, slope = 0;
            if (lattices_.has_faces(d)) {
              const auto felt = stencils.template gathered<2>(shares, d, &pulls_[d].data()->velocity);
              const double* x = stencils.x_shares(shares, d);
              u = felt.sum(x, 0);
              slope = felt.sum(x, 1);
            }
            particles.gas_force[p][d] = b * (u - particles.velocity(p)[d]) - sizes_.volume_of(p) * slope;
          }
        }
      },
      stencils_);
}

// What the gas has just lost is the particle's debt with the other sign; how the pull follows V.
template <class Scheme>
void Transfer::respond(const Scheme& scheme, ParticleStore& particles) {
  for (std::size_t p = 0; p < particles.owned; ++p) {
    Vec3& force = particles.gas_force[p];
    GasResponse& response = particles.gas_response[p];
    response.debt = -step_.dt * (felt_[p] * force - (1 - felt_[p]) * sizes_.mass_of(p) * setup_.gravity);
    for (int d = 0; d < 3; ++d)
      if (!lattices_.has_faces(d)) response.debt[d] = 0;  // nothing but the walls can take it
    response.drag = Scheme::anew ? 0 : drag_[p];
    response.share = scheme.felt_in_substep(response.drag * step_.dt / step_.substeps / sizes_.mass_of(p));
    force += response.drag * particles.velocity(p);
  }
}

ExchangeBalance Transfer::balance(const GasState& gas, const Exchange& exchange, const ParticleStore& particles) const {
  std::array<double, 9> sums{};  // lost x y z, received x y z, scale x y z
  for (int d = 0; d < 3; ++d) {
    // Without a face inside, nothing but the walls can take the particle's drag in this direction.
    if (!lattices_.has_faces(d)) continue;
    for (std::size_t p = 0; p < particles.owned; ++p) {
      const double force = relaxes_ ? -particles.gas_response[p].debt[d] / step_.dt : particles.gas_force[p][d];
      sums[3 + d] += force;
      sums[6 + d] += std::abs(force);
    }
    sums[3 + d] += paid_[d];
    lattices_.each_owned_row(d, [&](Int3 first, int n) {
      const std::ptrdiff_t c = grid_.index(first[0], first[1], first[2]);
      const auto node = lattices_.node_volume(d, first);
      for (int i = 0; i < n; ++i) {
        const std::ptrdiff_t at = c + i;
        const double drag = exchange.drag[d].data()[at] * gas.velocity[d].data()[at] - exchange.drag_momentum[d].data()[at];
        const double buoyancy = -grid_.cell_volume() * exchange.buoyancy[d].data()[at] * gradient_at(gas, d, at);
        sums[d] += node[i] * (drag + buoyancy);
        sums[6 + d] += node[i] * (std::abs(drag) + std::abs(buoyancy));
      }
    });
  }
  decomposition_.comm().sum(sums);
  return {{sums[0], sums[1], sums[2]}, {sums[3], sums[4], sums[5]}, {sums[6], sums[7], sums[8]}};
}

}  // namespace bedflow
