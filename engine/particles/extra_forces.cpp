#include "particles/forces.h"

namespace bedflow {

namespace {

// Calls sweep.operator()<with_ghost>(first, last, sizes, index of the pair of types) for all pairs of the list.
template <class Sweep>
void over_groups(const PairList& list, const DemSetup& setup, const ParticleStore& particles, Sweep sweep) {
  for (const PairList::Group& group : list.groups)
    with_sizes(group, setup, particles, [&](const auto& sizes) {
      const std::size_t pair = pair_index(group.types[0], group.types[1]);
      sweep.template operator()<false>(group.first, group.across, sizes, pair);
      sweep.template operator()<true>(group.across, group.last, sizes, pair);
    });
}

}  // namespace

void add_rolling_torques(PairList& list, const DemSetup& setup, const ParticleStore& particles, const Bodies& bodies,
                         const ContactLaws& laws) {
  const auto add = [&]<class Contact, class Rolling>(const LawTable<Contact>& contact, const LawTable<Rolling>& rolling) {
    if constexpr (!std::is_same_v<Rolling, FreeRolling>) {
      over_groups(
          list, setup, particles, [&]<bool with_ghost>(std::size_t first, std::size_t last, const auto& sizes, std::size_t pair) {
            sweep_rolling<native_lanes, with_ghost>(list, first, last, bodies, sizes, contact.pairs[pair], rolling.pairs[pair]);
          });
    }
  };
  std::visit(add, laws.contact, laws.rolling);
}

void add_cohesion_forces(PairList& list, const DemSetup& setup, const ParticleStore& particles, const Bodies& bodies,
                         const ContactLaws& laws) {
  const auto add = [&]<class Cohesion>(const LawTable<Cohesion>& cohesion) {
    if constexpr (!std::is_same_v<Cohesion, NoCohesion>) {
      over_groups(list, setup, particles,
                  [&]<bool with_ghost>(std::size_t first, std::size_t last, const auto& sizes, std::size_t pair) {
                    sweep_cohesion<native_lanes, with_ghost>(list, first, last, bodies, sizes, cohesion.pairs[pair]);
                  });
    }
  };
  std::visit(add, laws.cohesion);
}

}  // namespace bedflow
