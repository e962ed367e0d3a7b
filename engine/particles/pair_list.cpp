#include "particles/pair_list.h"

#include "particles/laws.h"

namespace bedflow {

namespace {

std::size_t type_at(const ParticleStore& particles, std::size_t row) {
  return particles.type.empty() ? 0 : particles.type[row];
}

}  // namespace

void PairList::build(const std::vector<Cells>& cells, const DemSetup& setup, const std::array<Plane, 6>& faces,
                     const ParticleStore& particles, std::span<const Vec3> places, std::span<const Vec3> shifts) {
  const double extra = setup.skin + setup.range;
  const bool one_size = setup.types.size() == 1 && !setup.distributed();
  const double widest = 2 * setup.types[0].radius + extra;
  pairs.clear();
  const auto add = [&](Vec3 from, Vec3 to, std::uint32_t i, std::uint32_t j) {
    const Vec3 apart = to - from;
    const double reach = one_size ? widest : radius_of(setup.types, particles, i) + radius_of(setup.types, particles, j) + extra;
    if (dot(apart, apart) >= reach * reach) return;
    const std::size_t type_i = type_at(particles, i), type_j = type_at(particles, j);
    const bool in_order = type_i != type_j ? type_i < type_j : particles.id[i] < particles.id[j];
    pairs.push_back(in_order ? Pair{i, j} : Pair{j, i});
  };
  const auto meet = [&](Vec3 place, std::uint32_t i, std::size_t other) {
    const double reach = radius_of(setup.types, particles, i) + setup.types[other].radius + extra;
    cells[other].around(place, reach, [&](std::uint32_t first, std::uint32_t last) {
      for (std::uint32_t j = first; j < last; ++j) add(place, places[j], i, j);
    });
  };
  for (std::size_t type = 0; type < cells.size(); ++type) {
    cells[type].behind([&](std::uint32_t i, std::uint32_t first, std::uint32_t last) {
      for (std::uint32_t j = first; j < last; ++j) add(places[i], places[j], i, j);
    });
    // The larger ones, which are fewer, look for the smaller ones.
    for (std::size_t other = 0; other < cells.size(); ++other) {
      const double mine = setup.types[type].radius, its = setup.types[other].radius;
      if (mine < its || (mine == its && type <= other)) continue;
      for (std::uint32_t i = cells[type].first(); i < cells[type].last(); ++i) meet(places[i], i, other);
    }
  }
  for (std::size_t ghost = particles.owned; ghost < places.size(); ++ghost) {
    const Vec3 place = places[ghost] + shifts[ghost - particles.owned];
    for (std::size_t other = 0; other < cells.size(); ++other) meet(place, static_cast<std::uint32_t>(ghost), other);
  }
  sort_into_groups(setup, particles);
  build_near(setup, faces, particles, places.first(particles.owned));
  const auto begin = [](Memory& memory, bool displacement, bool angle, std::size_t count) {
    for (auto [rows, kept] : {std::pair(&memory.displacement, displacement), std::pair(&memory.angle, angle)}) {
      rows->clear();
      if (!kept) continue;
      if (rows->capacity() < count) rows->reserve(count + count / 8);  // lists grow for long while a bed settles
      rows->assign(count, {});
    }
  };
  begin(pair_memory, setup.history, setup.rolling_history, pairs.size());
  begin(wall_memory, setup.history, setup.rolling_history, near.size());
  pairs.resize(pairs.size() + native_lanes);
}

// By counting; the order within a group is kept.
void PairList::sort_into_groups(const DemSetup& setup, const ParticleStore& particles) {
  const std::size_t count = setup.types.size() * (setup.types.size() + 1) / 2;
  const auto bin_of = [&](Pair pair) {
    const bool across = pair.first >= particles.owned || pair.second >= particles.owned;
    return 2 * pair_index(type_at(particles, pair.first), type_at(particles, pair.second)) + across;
  };
  std::vector<std::size_t> start(2 * count + 1, 0);
  for (const Pair pair : pairs) ++start[bin_of(pair) + 1];
  for (std::size_t b = 1; b < start.size(); ++b) start[b] += start[b - 1];
  groups.clear();
  for (std::size_t b = 0; b < setup.types.size(); ++b)
    for (std::size_t a = 0; a <= b; ++a) {
      const std::size_t g = 2 * pair_index(a, b);
      groups.push_back({{a, b}, start[g], start[g + 1], start[g + 2]});
    }
  if (count == 1) return;  // those across came last
  std::vector<Pair> sorted(pairs.size());
  for (const Pair pair : pairs) sorted[start[bin_of(pair)]++] = pair;
  pairs.swap(sorted);
}

// An open face is listed too: who stands beyond it is lost.
void PairList::build_near(const DemSetup& setup, const std::array<Plane, 6>& faces, const ParticleStore& particles,
                          std::span<const Vec3> places) {
  near.clear();
  for (int face = 0; face < 6; ++face) {
    const Side side = setup.sides[face / 2][face % 2];
    if (side == Side::periodic || side == Side::outlet) continue;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double reach = 0.5 * setup.skin + (side == Side::wall ? radius_of(setup.types, particles, i) : 0);
      if (faces[face].distance(places[i]) < reach) near.push_back({static_cast<std::uint32_t>(i), face});
    }
  }
}

void PairList::save(const ParticleStore& particles, double now, ContactHistory& history) const {
  history.clear(particles.owned);
  each_pair_memory(now, [&](std::size_t p, const ContactMemory& memory) {
    const auto [first, second] = pairs[p];
    if (first < particles.owned) history.add(first, particles.id[second], memory);
    if (second < particles.owned) history.add(second, particles.id[first], -memory);
  });
  each_wall_memory(now, [&](std::size_t w, const ContactMemory& memory) {
    history.add(near[w].particle, ContactHistory::wall_contact(near[w].face), memory);
  });
}

void PairList::load(const ParticleStore& particles, double now, const ContactHistory& history) {
  const auto take = [&](Memory& rows, std::size_t i, const ContactMemory& memory) {
    if (!rows.displacement.empty()) rows.displacement[i] = {memory.displacement, now};
    if (!rows.angle.empty()) rows.angle[i] = {memory.angle, now};
  };
  if (pair_memory.displacement.empty() && pair_memory.angle.empty()) return;
  for (std::size_t p = 0; p < count(); ++p) {
    const auto [first, second] = pairs[p];
    if (first < particles.owned) {
      if (const auto seen = history.find(first, particles.id[second])) take(pair_memory, p, *seen);
    } else if (const auto seen = history.find(second, particles.id[first])) {
      take(pair_memory, p, -*seen);
    }
  }
  for (std::size_t w = 0; w < near.size(); ++w)
    if (const auto seen = history.find(near[w].particle, ContactHistory::wall_contact(near[w].face))) take(wall_memory, w, *seen);
}

}  // namespace bedflow
