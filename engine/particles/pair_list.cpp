#include "particles/pair_list.h"

namespace bedflow {

void PairList::build(const Cells& cells, const DemSetup& setup, const std::array<Plane, 6>& faces, const ParticleStore& particles,
                     std::span<const Vec3> places, std::span<const Vec3> shifts) {
  const double reach = 2 * setup.radius + setup.skin;
  const auto add = [&](Vec3 from, Vec3 to, std::uint32_t i, std::uint32_t j) {
    const Vec3 apart = to - from;
    if (dot(apart, apart) >= reach * reach) return;
    pairs.push_back(particles.id[i] < particles.id[j] ? Pair{i, j} : Pair{j, i});
  };
  pairs.clear();
  cells.behind([&](std::uint32_t i, std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t j = first; j < last; ++j) add(places[i], places[j], i, j);
  });
  across = pairs.size();
  for (std::size_t ghost = particles.owned; ghost < places.size(); ++ghost) {
    const Vec3 place = places[ghost] + shifts[ghost - particles.owned];
    cells.around(place, [&](std::uint32_t first, std::uint32_t last) {
      for (std::uint32_t j = first; j < last; ++j) add(place, places[j], static_cast<std::uint32_t>(ghost), j);
    });
  }
  build_near(setup, faces, places.first(particles.owned));
  pair_history.assign(setup.history ? pairs.size() : 0, {});
  wall_history.assign(setup.history ? near.size() : 0, {});
}

// An open face is listed too: who stands beyond it is lost.
void PairList::build_near(const DemSetup& setup, const std::array<Plane, 6>& faces, std::span<const Vec3> places) {
  near.clear();
  for (int face = 0; face < 6; ++face) {
    const Side side = setup.sides[face / 2][face % 2];
    if (side == Side::periodic) continue;
    const double reach = 0.5 * setup.skin + (side == Side::wall ? setup.radius : 0);
    for (std::size_t i = 0; i < places.size(); ++i)
      if (faces[face].distance(places[i]) < reach) near.push_back({static_cast<std::uint32_t>(i), face});
  }
}

void PairList::save(const ParticleStore& particles, ContactHistory& history) const {
  history.clear(particles.owned);
  for (std::size_t p = 0; p < pair_history.size(); ++p) {
    if (pair_history[p] == Vec3{}) continue;
    const auto [low, high] = pairs[p];
    if (low < particles.owned) history.add(low, particles.id[high], pair_history[p]);
    if (high < particles.owned) history.add(high, particles.id[low], pair_history[p]);
  }
  for (std::size_t w = 0; w < wall_history.size(); ++w)
    if (wall_history[w] != Vec3{}) history.add(near[w].particle, ContactHistory::wall_contact(near[w].face), wall_history[w]);
}

void PairList::load(const ParticleStore& particles, const ContactHistory& history) {
  for (std::size_t p = 0; p < pair_history.size(); ++p) {
    const auto [low, high] = pairs[p];
    pair_history[p] = low < particles.owned ? history.find(low, particles.id[high]) : history.find(high, particles.id[low]);
  }
  for (std::size_t w = 0; w < wall_history.size(); ++w)
    wall_history[w] = history.find(near[w].particle, ContactHistory::wall_contact(near[w].face));
}

}  // namespace bedflow
