#include "particles/forces.h"

namespace bedflow {

namespace {

template <class Each>
WallResult add_forces(const Each& each, const DemSetup& setup, const ParticleStore& particles, const Bodies& bodies,
                      const ContactLaws& laws) {
  const auto rolling = [&]<class Contact, class Rolling>(const LawTable<Contact>& contact, const LawTable<Rolling>& law) {
    if constexpr (!std::is_same_v<Rolling, FreeRolling>) sweep_walls_rolling(each, particles, bodies, contact.walls, law.walls);
  };
  const auto cohesion = [&]<class Cohesion>(const LawTable<Cohesion>& law) {
    if constexpr (!std::is_same_v<Cohesion, NoCohesion>) sweep_walls_cohesion(each, setup.range, bodies, law.walls);
  };
  const auto contacts = [&]<class Contact, class Tangential>(const LawTable<Contact>& contact, const LawTable<Tangential>& law) {
    if constexpr (fit_together<Contact, Tangential>) return sweep_walls(each, particles, bodies, contact.walls, law.walls);
    return WallResult{};
  };
  std::visit(rolling, laws.contact, laws.rolling);
  std::visit(cohesion, laws.cohesion);
  return std::visit(contacts, laws.contact, laws.tangential);
}

}  // namespace

WallResult add_face_forces(PairList& list, const std::array<Plane, 6>& faces, const DemSetup& setup,
                           const ParticleStore& particles, const Bodies& bodies, const ContactLaws& laws,
                           std::vector<WallLoad>& loads) {
  const auto each = [&](double range, const auto& take) {
    return each_face_contact(list, faces, setup, particles, loads, range, take);
  };
  return add_forces(each, setup, particles, bodies, laws);
}

WallResult add_wall_forces(Walls& walls, const DemSetup& setup, const ParticleStore& particles, const Bodies& bodies,
                           const ContactLaws& laws, std::vector<WallLoad>& loads) {
  return add_forces([&](double range, const auto& take) { return walls.each_contact(loads, range, take); }, setup, particles,
                    bodies, laws);
}

}  // namespace bedflow
