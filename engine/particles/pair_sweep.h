// Forces and torques of all contacts between particles in a sub-step. Templates over the laws and over what is known of the
// sizes: what a scene does not need is not in the loop.
//
//   n = (Xj − Xi)/|Xj − Xi|,  δ = ri + rj − |Xj − Xi|,  ℓi = (|Xj − Xi|² + ri² − rj²)/(2|Xj − Xi|),  ℓj = |Xj − Xi| − ℓi
//   Vij = Vi − Vj + (ℓi ωi + ℓj ωj) × n,  F_i = −F_j = −F_n n + F_t,  T_i = ℓi n × F_t,  T_j = ℓj n × F_t
// (Cundall & Strack 1979)
//
// A register full of pairs at a time. The pairs of the list that touch are found first, without branches, and gathered in a short
// buffer; about every second one does. A pair is then two row loads and one multiply-add (Xj − Xi, Vj − Vi, ωi + ωj), transposed
// to columns; its forces are transposed back and added as rows.
#pragma once

#include <algorithm>

#include "base/simd.h"
#include "models/rolling.h"
#include "models/tangential.h"
#include "particles/pair_list.h"
#include "particles/store.h"

namespace bedflow {

// What the sweeps read and write: rows of owned + ghosts, forces of the owned.
struct Bodies {
  const ParticleRow* rows;
  const double* spin_z;
  std::size_t owned;
  ForceRow* force;
  const Vec3* shift;  // of ghosts, see GhostExchange
  double dt = 0;      // s
  double now = 0;     // number of the sub-step, for MemoryRow
};

// ---------------------------------------------------------------------------------------------------- sizes

// What the sweep knows of the sizes of a group's pairs: all the same, one for each of two types, or one for each particle.
struct OneSize {
  static constexpr bool equal = true, distributed = false;
  double radius, mass;
};
struct TwoSizes {
  static constexpr bool equal = false, distributed = false;
  double radius[2], mass[2];
};
struct ManySizes {
  static constexpr bool equal = false, distributed = true;
  const double* radius;     // of each row
  double mass_per_cube[2];  // mass over r³ of the two types
};

// Radii and masses of the pairs in a register.
template <class Real>
struct PairSizes {
  Real radius[2], mass[2];

  Real sum() const { return radius[0] + radius[1]; }
  Real reduced_mass() const { return mass[0] * mass[1] / (mass[0] + mass[1]); }
  Real reduced_radius() const { return radius[0] * radius[1] / (radius[0] + radius[1]); }
};

template <int lanes, class Sizes>
PairSizes<Pack<lanes>> sizes_of(const Sizes& sizes, const PairList::Pair* pairs) {
  using Real = Pack<lanes>;
  PairSizes<Real> result;
  if constexpr (Sizes::distributed) {
    for (int l = 0; l < lanes; ++l) {
      result.radius[0][l] = sizes.radius[pairs[l].first];
      result.radius[1][l] = sizes.radius[pairs[l].second];
    }
    for (int side = 0; side < 2; ++side)
      result.mass[side] = sizes.mass_per_cube[side] * result.radius[side] * result.radius[side] * result.radius[side];
  } else if constexpr (Sizes::equal) {
    for (int side = 0; side < 2; ++side)
      result.radius[side] = broadcast<Real>(sizes.radius), result.mass[side] = broadcast<Real>(sizes.mass);
  } else {
    for (int side = 0; side < 2; ++side)
      result.radius[side] = broadcast<Real>(sizes.radius[side]), result.mass[side] = broadcast<Real>(sizes.mass[side]);
  }
  return result;
}

// ---------------------------------------------------------------------------------------------------- a register of pairs

// What brings a ghost to its nearest image.
template <int lanes>
Vector3<Pack<lanes>> image_shift(const Bodies& bodies, const PairList::Pair* pairs) {
  const auto shift = [&](std::uint32_t row) { return row < bodies.owned ? Vec3{} : bodies.shift[row - bodies.owned]; };
  Vector3<Pack<lanes>> result;
  for (int l = 0; l < lanes; ++l) {
    const Vec3 both = shift(pairs[l].second) - shift(pairs[l].first);
    for (int d = 0; d < 3; ++d) result[d][l] = both[d];
  }
  return result;
}

// Xj − Xi of the pairs; of a ghost its nearest image counts.
template <int lanes, bool with_ghost>
Vector3<Pack<lanes>> apart(const Bodies& bodies, const PairList::Pair* pairs) {
  const auto place = [&](std::uint32_t row, int part) { return load<std::min(lanes, 4)>(&bodies.rows[row].position.x + part); };
  const auto columns =
      columns_of_four<lanes>([&](int l, int part) { return place(pairs[l].second, part) - place(pairs[l].first, part); });
  Vector3<Pack<lanes>> result{columns[0], columns[1], columns[2]};
  if constexpr (with_ghost) result += image_shift<lanes>(bodies, pairs);
  return result;
}

// ωi − ωj.
template <int lanes>
Vector3<Pack<lanes>> spin_difference(const Bodies& bodies, const PairList::Pair* pairs) {
  Vector3<Pack<lanes>> result;
  for (int l = 0; l < lanes; ++l) {
    const auto [first, second] = pairs[l];
    result.x[l] = bodies.rows[first].spin_x - bodies.rows[second].spin_x;
    result.y[l] = bodies.rows[first].spin_y - bodies.rows[second].spin_y;
    result.z[l] = bodies.spin_z[first] - bodies.spin_z[second];
  }
  return result;
}

// A register of pairs that touch.
template <int lanes>
struct PairContact {
  Vector3<Pack<lanes>> n, velocity;    // from i to j; Vi − Vj, m/s
  Vector3<Pack<lanes>> spin_sum;       // ωi + ωj, its third component not yet set, rad/s
  Pack<lanes> distance, per_distance;  // |Xj − Xi|, m, and its inverse
  PairSizes<Pack<lanes>> size;
  Touching<Pack<lanes>> touching;
};
template <int lanes, bool with_ghost, class Sizes>
PairContact<lanes> contact_of(const Bodies& bodies, const Sizes& sizes, const PairList::Pair* pairs) {
  const Pack<8> sign{-1, -1, -1, -1, -1, -1, 1, 1};
  const auto columns = columns_of_eight<lanes>([&](int l, int part) {
    return load<lanes>(&bodies.rows[pairs[l].second].position.x + part) +
           part_of<lanes>(sign, part) * load<lanes>(&bodies.rows[pairs[l].first].position.x + part);
  });
  Vector3<Pack<lanes>> between{columns[0], columns[1], columns[2]};
  if constexpr (with_ghost) between += image_shift<lanes>(bodies, pairs);
  PairContact<lanes> c;
  c.velocity = -Vector3<Pack<lanes>>{columns[3], columns[4], columns[5]};
  c.spin_sum.x = columns[6], c.spin_sum.y = columns[7];
  c.distance = norm(between);
  c.per_distance = 1 / c.distance;
  c.n = c.per_distance * between;
  c.size = sizes_of<lanes>(sizes, pairs);
  c.touching = {c.size.sum() - c.distance, dot(c.velocity, c.n), c.size.reduced_mass(), c.size.reduced_radius()};
  return c;
}

// Adds force and torques to the owned rows of the first `count` pairs. opposite: ℓj/ℓi, by which T_j exceeds T_i.
template <int lanes, bool with_ghost>
void add_to_rows(const Bodies& bodies, const PairList::Pair* pairs, int count, const Vector3<Pack<lanes>>& force,
                 const Vector3<Pack<lanes>>& torque, const Pack<lanes>& opposite) {
  const Pack<lanes> none{};
  const Pack<8> pull{0, 0, 0, -1, -1, -1, 0, 0}, turn{1, 0, 0, 0, 0, 0, 1, 1};
  double share[8];
  store(share, opposite);
  rows_of_eight<lanes>({torque.z, none, none, force.x, force.y, force.z, torque.x, torque.y},
                       [&](int l, int part, const Pack<lanes>& row) {
                         if (l >= count) return;
                         const auto [first, second] = pairs[l];
                         if (!with_ghost || first < bodies.owned) {
                           double* to = &bodies.force[first].torque_z + part;
                           store(to, load<lanes>(to) + row);
                         }
                         if (!with_ghost || second < bodies.owned) {
                           double* to = &bodies.force[second].torque_z + part;
                           const Pack<lanes> sign = part_of<lanes>(pull, part) + share[l] * part_of<lanes>(turn, part);
                           store(to, load<lanes>(to) + sign * row);
                         }
                       });
}

struct SweepResult {
  double deepest = 0;         // largest overlap over the sum of the radii
  std::int64_t contacts = 0;  // touching pairs, a pair across ranks at the owner of its first row
};

// What the law says of `count` contacts, those at places[…] of `rows` where it has a memory: 0 for one that did not touch in the
// sub-step before.
template <int lanes, class Law, class Contact>
Vector3<Pack<lanes>> with_memory(const Law& law, const Contact& contact, std::vector<MemoryRow>& rows,
                                 const std::uint64_t* places, int count, double now) {
  if constexpr (!Law::history) {
    return law(contact);
  } else {
    MemoryRow* const row = rows.data();
    const auto columns =
        columns_of_four<lanes>([&](int l, int part) { return load<std::min(lanes, 4)>(&row[places[l]].value.x + part); });
    const auto known = columns[3] == now - 1;
    Vector3<Pack<lanes>> memory;
    for (int d = 0; d < 3; ++d) memory[d] = select(known, columns[d], Pack<lanes>{});
    const Vector3<Pack<lanes>> result = law(contact, memory);
    rows_of_four<lanes>({memory.x, memory.y, memory.z, broadcast<Pack<lanes>>(now)}, count,
                        [&](int l) { return &row[places[l]].value.x; });
    return result;
  }
}

// ---------------------------------------------------------------------------------------------------- sweeps

// Finds the pairs in [first, last) of the list that are nearer than the sum of their radii plus `range`, and calls
// take(pairs, places in the list, count) for each register full of them; the lanes from count on repeat the last pair.
template <int lanes, bool with_ghost, class Sizes, class Take>
void each_near_pair(const PairList& list, std::size_t first, std::size_t last, const Bodies& bodies, const Sizes& sizes,
                    double range, Take take) {
  constexpr std::size_t room = 64;
  PairList::Pair pairs[room + lanes];
  std::uint64_t places[room + lanes], next[lanes];
  std::size_t count = 0;
  const PairList::Pair* const all = list.pairs.data();
  for (std::size_t p = first; p < last; p += lanes) {
    const PairList::Pair* here = all + p;
    const Vector3<Pack<lanes>> between = apart<lanes, with_ghost>(bodies, here);
    const Pack<lanes> reach = sizes_of<lanes>(sizes, here).sum() + range;
    unsigned bits = bits_of(dot(between, between) < reach * reach);
    const bool ends = last - p <= lanes;
    if (ends) bits &= (1u << (last - p)) - 1;
    for (int l = 0; l < lanes; ++l) next[l] = p + l;
    copy_set<lanes>(next, bits, places + count);
    count += copy_set<lanes>(here, bits, pairs + count);
    if (count < room - lanes && !ends) continue;
    if (ends && count > 0)
      for (std::size_t i = count; i < count + lanes; ++i) pairs[i] = pairs[count - 1], places[i] = places[count - 1];
    std::size_t done = 0;
    for (; ends ? done < count : done + lanes <= count; done += lanes)
      take(pairs + done, places + done, static_cast<int>(std::min<std::size_t>(lanes, count - done)));
    for (std::size_t i = done; i < count; ++i) pairs[i - done] = pairs[i], places[i - done] = places[i];
    count -= std::min(done, count);
  }
}

// Normal and tangential forces of the pairs in [first, last) of the list.
template <int lanes, bool with_ghost, class Sizes, class Contact, class Tangential>
[[gnu::flatten]] SweepResult sweep_contacts(PairList& list, std::size_t first, std::size_t last, const Bodies bodies,
                                            const Sizes sizes, const Contact contact, const Tangential tangential) {
  using Real = Pack<lanes>;
  SweepResult result;
  Real deepest{};
  each_near_pair<lanes, with_ghost>(
      list, first, last, bodies, sizes, 0, [&](const PairList::Pair* pairs, const std::uint64_t* places, int count) {
        PairContact<lanes> c = contact_of<lanes, with_ghost>(bodies, sizes, pairs);
        deepest = max(deepest, (1 / c.size.sum()) * c.touching.overlap);
        const Real normal = contact(c.touching);
        Vector3<Real> force = -normal * c.n, torque;
        Real arm = 0.5 * c.distance, other_arm = arm;
        if constexpr (Tangential::rotation) {
          for (int l = 0; l < lanes; ++l) c.spin_sum.z[l] = bodies.spin_z[pairs[l].first] + bodies.spin_z[pairs[l].second];
          Vector3<Real> turn = arm * c.spin_sum;
          if constexpr (!Sizes::equal) {
            // ℓi ωi + ℓj ωj = (ℓi + ℓj)/2 (ωi + ωj) + (ℓi − ℓj)/2 (ωi − ωj)
            const Real shift = 0.5 * c.per_distance * (c.size.radius[0] - c.size.radius[1]) * c.size.sum();
            arm += shift, other_arm -= shift;
            turn += shift * spin_difference<lanes>(bodies, pairs);
          }
          const Vector3<Real> slip = c.velocity - c.touching.approach * c.n + cross(turn, c.n);
          const Sliding<Real> sliding{c.n, slip, abs(normal), 2.0 / 7 * c.touching.mass, bodies.dt, c.touching};
          const Vector3<Real> friction =
              with_memory<lanes>(tangential, sliding, list.pair_memory.displacement, places, count, bodies.now);
          force += friction;
          torque = arm * cross(c.n, friction);
        }
        Real ratio = broadcast<Real>(1);
        if constexpr (!Sizes::equal) ratio = other_arm / arm;
        add_to_rows<lanes, with_ghost>(bodies, pairs, count, force, torque, ratio);
        result.contacts += count;
        if constexpr (with_ghost)
          for (int l = 0; l < count; ++l) result.contacts -= pairs[l].first >= bodies.owned;
      });
  result.deepest = largest(deepest);
  return result;
}

// Torques of rolling resistance of the pairs in [first, last) of the list.
template <int lanes, bool with_ghost, class Sizes, class Contact, class Rolling>
[[gnu::flatten]] void sweep_rolling(PairList& list, std::size_t first, std::size_t last, const Bodies bodies, const Sizes sizes,
                                    const Contact contact, const Rolling rolling) {
  using Real = Pack<lanes>;
  each_near_pair<lanes, with_ghost>(
      list, first, last, bodies, sizes, 0, [&](const PairList::Pair* pairs, const std::uint64_t* places, int count) {
        const PairContact<lanes> c = contact_of<lanes, with_ghost>(bodies, sizes, pairs);
        const Vector3<Real> relative = spin_difference<lanes>(bodies, pairs);
        const Real inertia_i = 0.4 * c.size.mass[0] * c.size.radius[0] * c.size.radius[0],
                   inertia_j = 0.4 * c.size.mass[1] * c.size.radius[1] * c.size.radius[1];
        const RollingContact<Real> rolls{c.n,
                                         relative - dot(relative, c.n) * c.n,
                                         abs(contact(c.touching)),
                                         inertia_i * inertia_j / (inertia_i + inertia_j),
                                         bodies.dt,
                                         c.touching};
        const Vector3<Real> torque = with_memory<lanes>(rolling, rolls, list.pair_memory.angle, places, count, bodies.now);
        add_to_rows<lanes, with_ghost>(bodies, pairs, count, {}, torque, broadcast<Real>(-1));
      });
}

// Attraction of the pairs in [first, last) of the list.
template <int lanes, bool with_ghost, class Sizes, class Cohesion>
[[gnu::flatten]] void sweep_cohesion(PairList& list, std::size_t first, std::size_t last, const Bodies bodies, const Sizes sizes,
                                     const Cohesion cohesion) {
  using Real = Pack<lanes>;
  each_near_pair<lanes, with_ghost>(list, first, last, bodies, sizes, cohesion.furthest,
                                    [&](const PairList::Pair* pairs, const std::uint64_t* /*places*/, int count) {
                                      const PairContact<lanes> c = contact_of<lanes, with_ghost>(bodies, sizes, pairs);
                                      const Vector3<Real> pull = cohesion(-c.touching.overlap, c.touching.radius) * c.n;
                                      add_to_rows<lanes, with_ghost>(bodies, pairs, count, pull, {}, Real{});
                                    });
}

}  // namespace bedflow
