// Particles to grid and back, with the same weights both ways: what the gas gives the particles receive, to round-off.
//
// Volume and ε go to the cell centres; b, bV, buoyancy, U, ∇p to the faces of each velocity component (lattices.h).
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <variant>
#include <vector>

#include "base/phase_timer.h"
#include "coupling/fences.h"
#include "coupling/lattices.h"
#include "coupling/rows_in_use.h"
#include "coupling/smoothing.h"
#include "coupling/stencils.h"
#include "gas/gas_solver.h"
#include "grid/grid.h"
#include "grid/halo.h"
#include "models/drag.h"
#include "models/exchange.h"
#include "models/kernel.h"
#include "particles/dem.h"

namespace bedflow {

// How many points along each direction carry a particle; most_points at most.
int kernel_points(const Kernel& kernel, double diameter, Vec3 spacing);
inline constexpr int most_points = 4;
// Ghost layers that it takes. shared: blocks or periodic images meet, and a particle may stand half a skin (m) beyond its block.
int kernel_ghosts(const Kernel& kernel, double diameter, Vec3 spacing, double skin, bool shared);

struct TransferSetup {
  Kernel kernel{};               // a Gaussian is as wide as the largest particle makes it
  double diameter = 0;           // of a particle, of the largest where there are several sizes, m
  double particle_volume = 0;    // m³
  double mass = 0;               // kg; as gravity, for schemes that relax
  Vec3 gravity{};                // m/s²
  double fraction_floor = 0.35;  // of ε
  ExchangeScheme scheme{};
  double coarse_graining = 1;  // diameter of what is computed over that of the particles that it stands for, which feel the drag
  std::vector<ParticleType> types = {};  // where there are several types or sizes: volumes and masses are then each's own
  std::vector<Panel> panels = {};        // inside the box; not with a Gaussian, which would spread through them
};

// What the particles do while the gas takes a step.
struct Interval {
  double dt = 0;  // s
  int substeps = 1;
};

// Force between gas and particles, summed over the box, N.
struct ExchangeBalance {
  Vec3 lost_by_gas, received_by_particles;
  Vec3 scale;  // sums of absolute values: what round-off is measured against
};

class Transfer {
 public:
  Transfer(const Decomposition& decomposition, const Grid& grid, Halo& halo, const TransferSetup& setup, PhaseTimer& timer);

  // ε at cell centres, ghosts and the cells beyond walls too. Returns the solids volume (m³, this rank) that the floor hid.
  double deposit_volume(const ParticleStore& particles, Field& fraction);

  // Of the last deposit the smallest ε of a cell of this block, before the floor, and where it is.
  struct Lowest {
    double fraction = 1;
    Int3 cell{};
  };
  const Lowest& lowest() const { return lowest_; }

  // Beyond a face of the box a centre field is what it is in the cell inside.
  void mirror_at_faces(Field& field) const;

  // Where the particles are, for what follows; deposit_volume has done it.
  void locate(const ParticleStore& particles);

  // b of every particle from U and ε at its place. The diameter in `scene` is that of the particles that feel it, where all are
  // alike; a parcel feels as much as all that it stands for.
  template <class Drag>
  void find_drag(const Drag& drag, const DragScene& scene, const ParticleStore& particles, const GasState& gas);

  // b, bV and buoyancy to the faces, as the gas is to lose them in the step, with what it still owes (models/exchange.h).
  void deposit_drag(const ParticleStore& particles, const Interval& step, Exchange& exchange);

  // The largest b/m of the last find_drag, this rank, 1/s.
  double fastest_response() const {
    double fastest = 0;
    for (std::size_t p = 0; p < drag_.size(); ++p) fastest = std::max(fastest, drag_[p] / sizes_.mass_of(p));
    return fastest;
  }

  // From the gas at the end of the step: F_g = −𝒱∇p + b (U − V) of every particle into gas_force, and for schemes that relax how
  // it follows V into gas_response.
  void sample(const GasState& gas, ParticleStore& particles);

  // The same force at the particles' new places and velocities within the step, after locate and find_drag.
  void pull(ParticleStore& particles);

  // Sums what the gas lost in the step (from its own fields) and what the particles received. Collective.
  ExchangeBalance balance(const GasState& gas, const Exchange& exchange, const ParticleStore& particles) const;

 private:
  struct alignas(32) Share {  // of a face, added as one
    double drag = 0, drag_momentum = 0, solids = 0, unused = 0;
  };
  struct alignas(16) Pull {             // on a face
    double velocity = 0, gradient = 0;  // U, m/s, and ∇p, Pa/m, as the particles feel them
  };
  // Of all particles alike, or one a particle.
  struct Sizes {
    std::vector<double> diameter, volume, mass;  // m, m³, kg
    std::size_t step = 0;
    double diameter_of(std::size_t p) const { return diameter[p * step]; }
    double volume_of(std::size_t p) const { return volume[p * step]; }
    double mass_of(std::size_t p) const { return mass[p * step]; }
  };
  void find_places(const ParticleStore& particles);
  void find_sizes(const ParticleStore& particles);
  // U as a particle feels it: that of the gas, or smoothed.
  const FaceField& felt_velocity(const FaceField& velocity);
  void slips(const ParticleStore& particles, const FaceField& velocity, const Field& fraction);
  template <class Scheme>
  void respond(const Scheme& scheme, ParticleStore& particles);
  void spread(const ParticleStore& particles, Exchange& exchange);
  void per_node_volume(Exchange& exchange);
  // ∇p that gas and particles share: without what plates take.
  double gradient_at(const GasState& gas, int d, std::ptrdiff_t at) const {
    const double *p = gas.pressure.data(), taken = gas.jump ? (*gas.jump)[d].data()[at] : 0;
    return (p[at] - p[at - grid_.stride(d)] + taken) / grid_.spacing[d] - gas.fall[d];
  }

  const Decomposition& decomposition_;
  Lowest lowest_;
  const Grid& grid_;
  Halo& halo_;
  TransferSetup setup_;
  bool relaxes_;
  PhaseTimer& timer_;
  Lattices lattices_;
  RowsInUse rows_;
  Fences fences_;
  std::optional<Smoothing> smoothing_;
  std::variant<Stencils<2>, Stencils<3>, Stencils<4>> stencils_;
  Interval step_;
  Sizes sizes_;
  std::vector<double> slip_, fraction_, drag_, felt_;  // of each owned particle: |U − V|, ε, b, ψ
  Vec3 paid_;                                          // debts of this rank's particles that the gas pays in the step, N
  std::array<std::vector<Share>, 3> shares_;           // of the faces of each direction, in a field's order; 0 between sweeps
  std::array<std::vector<Pull>, 3> pulls_;             // on the faces of each direction, in a field's order
  Field gradient_;                                     // ∇p of a direction on its way there
  FaceField buoyancy_share_;  // share of ∇p that acts on particles: 1 but where the floor limits the solids of a face
  FaceField smooth_velocity_;
};

}  // namespace bedflow
