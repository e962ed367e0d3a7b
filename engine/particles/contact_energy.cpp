// The energy of contacts: of the springs of the normal, tangential and rolling laws, and of attraction. Asked for rarely, so it
// goes pair by pair.
#include "particles/forces.h"

namespace bedflow {

namespace {

// A contact as this file needs it: displacement and angle are null where there is no memory.
struct Held {
  std::size_t law;  // of LawTable::pairs or walls
  Touching<double> touching;
  const MemoryRow *displacement, *angle;
};

// The two tables of a law are of pairs and of walls.
template <bool walls, class Law>
const Law& chosen(const LawTable<Law>& table, std::size_t index) {
  return walls ? table.walls[index] : table.pairs[index];
}

// Laws without a spring hold nothing, and their tables may be empty.
template <bool walls, class Law>
double spring_energy(const LawTable<Law>& table, const Held& held, const MemoryRow* memory, double now) {
  if constexpr (requires(const Law& law) { law.energy(held.touching, Vec3{}); }) {
    if (memory && memory->touched == now) return chosen<walls>(table, held.law).energy(held.touching, memory->value);
  }
  return 0;
}

template <bool walls>
ContactEnergy energy_of(const Held& held, const ContactLaws& laws, double now) {
  ContactEnergy energy;
  if (held.touching.overlap > 0) {
    const auto normal = [&](const auto& table) { return chosen<walls>(table, held.law).energy(held.touching); };
    const auto tangential = [&](const auto& table) { return spring_energy<walls>(table, held, held.displacement, now); };
    const auto rolling = [&](const auto& table) { return spring_energy<walls>(table, held, held.angle, now); };
    energy.stored =
        std::visit(normal, laws.contact) + std::visit(tangential, laws.tangential) + std::visit(rolling, laws.rolling);
  }
  if (const auto* cohesion = std::get_if<LawTable<VanDerWaals>>(&laws.cohesion))
    energy.bound = chosen<walls>(*cohesion, held.law).energy(-held.touching.overlap, held.touching.radius);
  return energy;
}

const MemoryRow* row(const std::vector<MemoryRow>& rows, std::size_t at) {
  return rows.empty() ? nullptr : &rows[at];
}

}  // namespace

ContactEnergy contact_energy(PairList& list, const std::array<Plane, 6>& faces, Walls& walls, const DemSetup& setup,
                             const ParticleStore& particles, const Bodies& bodies, const ContactLaws& laws) {
  ContactEnergy all;
  const auto add = [&](const ContactEnergy& energy) {
    all.stored += energy.stored;
    all.bound += energy.bound;
  };
  const auto place = [&](std::size_t i) {
    return particles.position(i) + (i < bodies.owned ? Vec3{} : bodies.shift[i - bodies.owned]);
  };
  for (const PairList::Group& group : list.groups)
    for (std::size_t p = group.first; p < group.last; ++p) {
      const auto [i, j] = list.pairs[p];
      if (i >= bodies.owned) continue;  // the other rank's, or the other image's
      const double ri = radius_of(setup.types, particles, i), rj = radius_of(setup.types, particles, j);
      const double overlap = ri + rj - norm(place(j) - place(i));
      if (!(overlap > -setup.range)) continue;
      add(energy_of<false>({pair_index(group.types[0], group.types[1]),
                            {overlap, 0, 0, ri * rj / (ri + rj)},
                            row(list.pair_memory.displacement, p),
                            row(list.pair_memory.angle, p)},
                           laws, bodies.now));
    }
  std::vector<WallLoad> unused(faces.size() + walls.size());
  const auto take = [&](const WallContact& c) {
    add(energy_of<true>({c.law, {c.touching.overlap, 0, 0, c.touching.radius}, c.displacement, c.angle}, laws, bodies.now));
  };
  each_face_contact(list, faces, setup, particles, unused, setup.range, take);
  walls.each_contact(unused, setup.range, take);
  return all;
}

}  // namespace bedflow
