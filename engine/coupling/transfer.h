// Particles to grid and back, with the same weights both ways: what the gas gives the particles receive, to round-off.
//
// Four lattices: the cell centres (volume, ε) and the faces of each velocity component (b, bV, buoyancy, U, ∇p). A face of
// the box is no point of a face lattice; its share folds onto the next face inside, which therefore stands for 1½ cells (2
// between walls two cells apart): sums over faces are weighted with that `node volume`.
#pragma once

#include <array>

#include "base/phase_timer.h"
#include "gas/simple.h"
#include "grid/grid.h"
#include "grid/halo.h"
#include "models/drag.h"
#include "models/kernel.h"
#include "particles/dem.h"

namespace bedflow {

// Force between gas and particles, summed over the box, N.
struct ExchangeBalance {
  Vec3 lost_by_gas, received_by_particles;
  Vec3 scale;  // sums of absolute values: what round-off is measured against
};

class Transfer {
 public:
  Transfer(const Decomposition& decomposition, const Grid& grid, Halo& halo, double particle_volume, double fraction_floor,
           PhaseTimer& timer);

  // ε at cell centres, ghosts and the cells beyond walls too. Returns the solids volume (m³, all ranks) that the floor hid.
  double deposit_volume(const ParticleStore& particles, Field& fraction);

  // Beyond a face of the box a centre field is what it is in the cell inside.
  void mirror_at_faces(Field& field) const;

  // b of every particle from U and ε at its place, and b, bV and its buoyancy to the faces.
  template <class Drag>
  void deposit_drag(const Drag& drag, const DragScene& scene, const ParticleStore& particles, const GasState& gas,
                    Exchange& exchange);

  // F_g = −𝒱 ∇p + b (U − V) of every particle into particles.gas_force, with the b of the last deposit_drag.
  void sample(const GasState& gas, ParticleStore& particles);

  // Sums what the gas lost in the step (from its own fields) and what the particles received. Collective.
  ExchangeBalance balance(const GasState& gas, const Exchange& exchange, const ParticleStore& particles) const;

  // Value of a centre field at a place, with the weights of the deposit.
  double at(const Field& field, Vec3 place) const;

 private:
  using Share = double __attribute__((vector_size(32)));  // b, bV, solids of a face, and nothing: added as one
  struct Weights;                                         // stencils of one particle on both lattices of each direction
  Weights weights(Vec3 place) const;
  bool has_faces(int d) const { return lowest_face_[d] <= highest_face_[d]; }
  double node_volume(int d, int face) const;  // in cells
  template <class Take>
  void each_owned_face(int d, Take take) const;
  double pressure_gradient(const Field& pressure, int d, std::ptrdiff_t at) const;

  const Decomposition& decomposition_;
  const Grid& grid_;
  Halo& halo_;
  double particle_volume_, fraction_floor_;
  PhaseTimer& timer_;
  Int3 lowest_cell_{}, highest_cell_{}, lowest_face_{}, highest_face_{};
  std::vector<double> drag_;                  // b of each owned particle, kg/s
  std::array<std::vector<Share>, 3> shares_;  // of the faces of each direction, in a field's order
  FaceField gradient_;                        // ∇p as the particles feel it, Pa/m
  FaceField buoyancy_share_;  // share of ∇p that acts on particles: 1 but where the floor limits the solids of a face
};

}  // namespace bedflow
