#include "particles/forces.h"

namespace bedflow {

SweepResult add_pair_forces(PairList& list, const DemSetup& setup, const ParticleStore& particles, const Bodies& bodies,
                            const ContactLaws& laws) {
  SweepResult result;
  const auto sweep = [&]<class Contact, class Tangential>(const LawTable<Contact>& contact,
                                                          const LawTable<Tangential>& tangential) {
    if constexpr (fit_together<Contact, Tangential>) {
      for (const PairList::Group& group : list.groups) {
        const std::size_t pair = pair_index(group.types[0], group.types[1]);
        with_sizes(group, setup, particles, [&](const auto& sizes) {
          const auto run = [&]<bool with_ghost>(std::size_t first, std::size_t last) {
            const SweepResult part = sweep_contacts<native_lanes, with_ghost>(list, first, last, bodies, sizes,
                                                                              contact.pairs[pair], tangential.pairs[pair]);
            result.deepest = max(result.deepest, part.deepest);
            result.contacts += part.contacts;
          };
          run.template operator()<false>(group.first, group.across);
          run.template operator()<true>(group.across, group.last);
        });
      }
    }
  };
  std::visit(sweep, laws.contact, laws.tangential);
  return result;
}

}  // namespace bedflow
