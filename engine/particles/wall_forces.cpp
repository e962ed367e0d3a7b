#include "particles/forces.h"

namespace bedflow {

WallResult add_wall_forces(PairList& list, const std::array<Plane, 6>& faces, const DemSetup& setup,
                           const ParticleStore& particles, const Bodies& bodies, const ContactLaws& laws) {
  return std::visit(
      [&]<class Contact, class Tangential>(const LawTable<Contact>& contact, const LawTable<Tangential>& tangential) {
        if constexpr (fit_together<Contact, Tangential>)
          return sweep_walls(list, faces, setup, particles, bodies, contact.walls, tangential.walls);
        return WallResult{};
      },
      laws.contact, laws.tangential);
}

}  // namespace bedflow
