// The contact forces of a sub-step, by the laws of the scene.
#pragma once

#include "particles/laws.h"
#include "particles/pair_sweep.h"
#include "particles/wall_sweep.h"
#include "particles/walls.h"

namespace bedflow {

// Add the forces and torques of the normal and tangential laws to bodies.force.
SweepResult add_pair_forces(PairList& list, const DemSetup& setup, const ParticleStore& particles, const Bodies& bodies,
                            const ContactLaws& laws);
// Add those of rolling resistance and of cohesion between particles, where the scene has them.
void add_rolling_torques(PairList& list, const DemSetup& setup, const ParticleStore& particles, const Bodies& bodies,
                         const ContactLaws& laws);
void add_cohesion_forces(PairList& list, const DemSetup& setup, const ParticleStore& particles, const Bodies& bodies,
                         const ContactLaws& laws);
// Add those of all laws on the faces of the box and on the walls of the scene, and what these receive to the loads: of the six
// faces, then of the walls.
WallResult add_face_forces(PairList& list, const std::array<Plane, 6>& faces, const DemSetup& setup,
                           const ParticleStore& particles, const Bodies& bodies, const ContactLaws& laws,
                           std::vector<WallLoad>& loads);
WallResult add_wall_forces(Walls& walls, const DemSetup& setup, const ParticleStore& particles, const Bodies& bodies,
                           const ContactLaws& laws, std::vector<WallLoad>& loads);

// What contacts hold that touch, or attract each other, at the places of the particles; memories are those of sub-step
// bodies.now.
struct ContactEnergy {
  double stored = 0;  // in springs, J
  double bound = 0;   // potential of attraction, below 0, J
};
ContactEnergy contact_energy(PairList& list, const std::array<Plane, 6>& faces, Walls& walls, const DemSetup& setup,
                             const ParticleStore& particles, const Bodies& bodies, const ContactLaws& laws);

// Calls sweep(sizes) with what is known of the sizes of a group's pairs.
template <class Sweep>
void with_sizes(const PairList::Group& group, const DemSetup& setup, const ParticleStore& particles, Sweep sweep) {
  const ParticleType &a = setup.types[group.types[0]], &b = setup.types[group.types[1]];
  if (a.distributed || b.distributed) {
    sweep(ManySizes{particles.radius.data(), {a.mass_of(1), b.mass_of(1)}});
  } else if (a.radius == b.radius && a.density == b.density) {
    sweep(OneSize{a.radius, a.mass()});
  } else {
    sweep(TwoSizes{{a.radius, b.radius}, {a.mass(), b.mass()}});
  }
}

}  // namespace bedflow
