// The vectorised sweeps against the laws applied to one pair at a time, at every width that this machine's registers hold.
#include "particles/pair_sweep.h"

#include <gtest/gtest.h>

#include <random>

#include "models/cohesion.h"
#include "particles/skin_tuner.h"

namespace bedflow {
namespace {

constexpr int steps = 3;  // so that contacts remember

// Spheres thrown into a box so that many overlap, and a list of all pairs: also of those that do not touch.
struct Crowd {
  std::vector<ParticleRow> rows;
  std::vector<double> spin_z, radius;
  PairList list;

  explicit Crowd(std::size_t count, double smallest, double largest) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> place(0, 0.006), speed(-0.5, 0.5), turn(-300, 300), size(smallest, largest);
    for (std::size_t i = 0; i < count; ++i) {
      rows.push_back({{place(random), place(random), place(random)},
                      {speed(random), speed(random), speed(random)},
                      turn(random),
                      turn(random)});
      spin_z.push_back(turn(random));
      radius.push_back(size(random));
    }
    for (std::uint32_t i = 0; i < count; ++i)
      for (std::uint32_t j = i + 1; j < count; ++j) list.pairs.push_back({i, j});
    list.groups = {{{0, 0}, 0, list.pairs.size(), list.pairs.size()}};
    list.pair_memory.displacement.resize(list.pairs.size());
    list.pair_memory.angle.resize(list.pairs.size());
    list.pairs.resize(list.pairs.size() + native_lanes);
  }
  Vec3 spin(std::size_t i) const { return {rows[i].spin_x, rows[i].spin_y, spin_z[i]}; }
  Bodies bodies(std::vector<ForceRow>& force, double now) {
    force.assign(rows.size(), {});
    return {rows.data(), spin_z.data(), rows.size(), force.data(), nullptr, 1e-6, now};
  }
};

constexpr double density = 2500;
double mass_of(double radius) {
  return ParticleType{radius, density, false}.mass();
}

// Calls take(i, j, n, |Xj − Xi|, Touching, place in the list) for pairs nearer than `range` beyond touching, by the definitions.
template <class Take>
void one_at_a_time(Crowd& crowd, double range, Take take) {
  for (std::size_t p = 0; p < crowd.list.count(); ++p) {
    const auto [i, j] = crowd.list.pairs[p];
    const Vec3 between = crowd.rows[j].position - crowd.rows[i].position;
    const double distance = norm(between), ri = crowd.radius[i], rj = crowd.radius[j];
    if (distance >= ri + rj + range) continue;
    const Vec3 n = (1 / distance) * between;
    const double mi = mass_of(ri), mj = mass_of(rj);
    take(i, j, n, distance,
         Touching<double>{ri + rj - distance, dot(crowd.rows[i].velocity - crowd.rows[j].velocity, n), mi * mj / (mi + mj),
                          ri * rj / (ri + rj)},
         p);
  }
}

template <class Contact, class Tangential>
void contacts(Crowd& crowd, const Bodies& bodies, const Contact& contact, const Tangential& tangential) {
  one_at_a_time(crowd, 0, [&](auto i, auto j, Vec3 n, double distance, const Touching<double>& touching, std::size_t p) {
    const double ri = crowd.radius[i], rj = crowd.radius[j];
    const double li = (distance * distance + ri * ri - rj * rj) / (2 * distance), lj = distance - li;
    const double normal = contact(touching);
    const Vec3 v = crowd.rows[i].velocity - crowd.rows[j].velocity;
    Vec3 force = -normal * n, friction;
    if constexpr (Tangential::rotation) {
      const Vec3 slip = v - dot(v, n) * n + cross(li * crowd.spin(i) + lj * crowd.spin(j), n);
      const Sliding<double> sliding{n, slip, std::abs(normal), 2.0 / 7 * touching.mass, bodies.dt, touching};
      if constexpr (Tangential::history) {
        friction = tangential(sliding, crowd.list.pair_memory.displacement[p].value);
      } else {
        friction = tangential(sliding);
      }
      force += friction;
    }
    bodies.force[i].add(force, li * cross(n, friction));
    bodies.force[j].add(-force, lj * cross(n, friction));
  });
}

void expect_same(const std::vector<ForceRow>& a, const std::vector<ForceRow>& b, const char* what) {
  double force = 0, torque = 0;
  for (const ForceRow& row : b) force = max(force, norm(row.force)), torque = max(torque, norm(row.torque()));
  ASSERT_GT(force + torque, 0) << what;
  for (std::size_t i = 0; i < a.size(); ++i) {
    // Round-off: the differences of two places are taken once, tens of operations follow, up to 40 contacts are summed.
    EXPECT_LT(norm(a[i].force - b[i].force), 1e-13 * force + 1e-300) << what << " " << i;
    EXPECT_LT(norm(a[i].torque() - b[i].torque()), 1e-13 * torque + 1e-300) << what << " " << i;
  }
}

template <class Sizes, class Sweep, class Reference>
void compare(double smallest, double largest, const char* what, Sweep sweep, Reference reference) {
  Crowd vectors(203, smallest, largest), scalars(203, smallest, largest);
  std::vector<ForceRow> fast, slow;
  for (int step = 1; step <= steps; ++step) {
    sweep(vectors, vectors.bodies(fast, step));
    reference(scalars, scalars.bodies(slow, step));
    expect_same(fast, slow, what);
  }
}

template <int lanes, class Contact, class Tangential>
void compare_contacts(const Contact& contact, const Tangential& tangential) {
  const double r = 6e-4;
  const auto reference = [&](Crowd& crowd, const Bodies& bodies) { contacts(crowd, bodies, contact, tangential); };
  const auto with = [&](auto sizes) {
    return [&, sizes](Crowd& crowd, const Bodies& bodies) {
      sweep_contacts<lanes, false>(crowd.list, 0, crowd.list.count(), bodies, sizes, contact, tangential);
    };
  };
  compare<OneSize>(r, r, "one size", with(OneSize{r, mass_of(r)}), reference);
  compare<TwoSizes>(r, r, "two sizes", with(TwoSizes{{r, r}, {mass_of(r), mass_of(r)}}), reference);
  compare<ManySizes>(
      2e-4, 8e-4, "many sizes",
      [&](Crowd& crowd, const Bodies& bodies) {
        const double of_one = mass_of(1);
        sweep_contacts<lanes, false>(crowd.list, 0, crowd.list.count(), bodies, ManySizes{crowd.radius.data(), {of_one, of_one}},
                                     contact, tangential);
      },
      reference);
}

template <class Lanes>
class PairSweep : public testing::Test {};
template <int n>
using Lanes = std::integral_constant<int, n>;
#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
using Widths = testing::Types<Lanes<2>, Lanes<4>, Lanes<8>>;
#elif defined(__AVX2__)
using Widths = testing::Types<Lanes<2>, Lanes<4>>;
#else
using Widths = testing::Types<Lanes<2>>;
#endif
TYPED_TEST_SUITE(PairSweep, Widths);

TYPED_TEST(PairSweep, DoesWhatTheLawsSayPairByPair) {
  constexpr int lanes = TypeParam::value;
  const auto spring = LinearSpringDashpot::from_restitution(500, 0.9);
  const auto hertz = Hertz::from_restitution(1e7, 0.9);
  compare_contacts<lanes>(spring, Frictionless{});
  compare_contacts<lanes>(spring, Coulomb{0.3});
  compare_contacts<lanes>(spring, TangentialSpring::from_normal(0.3, spring));
  compare_contacts<lanes>(hertz, Coulomb{0.3});
  compare_contacts<lanes>(hertz, Mindlin{0.3, 3e6, 0.1});
}

TYPED_TEST(PairSweep, RollsAsTheLawsSayPairByPair) {
  constexpr int lanes = TypeParam::value;
  const auto contact = LinearSpringDashpot::from_restitution(500, 0.9);
  const auto run = [&](const auto& rolling) {
    using Rolling = std::remove_cvref_t<decltype(rolling)>;
    compare<ManySizes>(
        2e-4, 8e-4, Rolling::name,
        [&](Crowd& crowd, const Bodies& bodies) {
          const double of_one = mass_of(1);
          sweep_rolling<lanes, false>(crowd.list, 0, crowd.list.count(), bodies, ManySizes{crowd.radius.data(), {of_one, of_one}},
                                      contact, rolling);
        },
        [&](Crowd& crowd, const Bodies& bodies) {
          one_at_a_time(crowd, 0, [&](auto i, auto j, Vec3 n, double, const Touching<double>& touching, std::size_t p) {
            const Vec3 relative = crowd.spin(i) - crowd.spin(j);
            const double inertia_i = inertia_of(mass_of(crowd.radius[i]), crowd.radius[i]),
                         inertia_j = inertia_of(mass_of(crowd.radius[j]), crowd.radius[j]);
            const RollingContact<double> rolls{n,
                                               relative - dot(relative, n) * n,
                                               std::abs(contact(touching)),
                                               1 / (1 / inertia_i + 1 / inertia_j),
                                               bodies.dt,
                                               touching};
            Vec3 torque;
            if constexpr (Rolling::history) {
              torque = rolling(rolls, crowd.list.pair_memory.angle[p].value);
            } else {
              torque = rolling(rolls);
            }
            bodies.force[i].add({}, torque);
            bodies.force[j].add({}, -torque);
          });
        });
  };
  run(ConstantRolling{0.05});
  run(SpringRolling{0.05, 500, 0.3});
}

TYPED_TEST(PairSweep, AttractsAsTheLawSaysPairByPair) {
  constexpr int lanes = TypeParam::value;
  const double r = 4e-4;
  const VanDerWaals law{1e-10, 1e-5, 2e-4};
  compare<OneSize>(
      r, r, "van der Waals",
      [&](Crowd& crowd, const Bodies& bodies) {
        sweep_cohesion<lanes, false>(crowd.list, 0, crowd.list.count(), bodies, OneSize{r, mass_of(r)}, law);
      },
      [&](Crowd& crowd, const Bodies& bodies) {
        one_at_a_time(crowd, law.furthest, [&](auto i, auto j, Vec3 n, double, const Touching<double>& touching, std::size_t) {
          const Vec3 pull = law(-touching.overlap, touching.radius) * n;
          bodies.force[i].add(pull, {});
          bodies.force[j].add(-pull, {});
        });
      });
}

TEST(PairSweep, AContactThatWasApartStartsWithoutMemory) {
  Crowd crowd(203, 6e-4, 6e-4);
  std::vector<ForceRow> force;
  const auto spring = LinearSpringDashpot::from_restitution(500, 0.9);
  const auto sweep = [&](double now) {
    sweep_contacts<native_lanes, false>(crowd.list, 0, crowd.list.count(), crowd.bodies(force, now), OneSize{6e-4, mass_of(6e-4)},
                                        spring, TangentialSpring::from_normal(0.3, spring));
  };
  sweep(1);
  const std::vector<ForceRow> first = force;
  sweep(3);  // nothing touched in sub-step 2
  for (std::size_t i = 0; i < force.size(); ++i) EXPECT_EQ(force[i].force, first[i].force) << i;
}

// The cheapest of its model, found from either side, and where it was once it is there.
TEST(SkinTuner, FindsTheCheapestSkinOfItsModel) {
  const double diameter = 1e-3;
  const auto settles_at = [&](double start, double substeps_at_tenth) {
    SkinTuner tuner(diameter, 0.5 * diameter);
    double skin = start;
    for (int turn = 0; turn < 12; ++turn) {
      const double x = skin / diameter, pairs = 3.8 * std::pow((1 + x) / 1.1, 3);
      tuner.counts = {static_cast<std::int64_t>(8 * substeps_at_tenth * x / 0.1), 8};
      EXPECT_TRUE(tuner.due());
      skin = tuner.choose(skin, pairs);
    }
    return skin / diameter;
  };
  for (const double substeps : {20.0, 80.0, 2000.0}) EXPECT_NEAR(settles_at(5e-4, substeps), settles_at(3e-5, substeps), 0.03);
  EXPECT_GT(settles_at(1e-4, 20), settles_at(1e-4, 80) + 0.05);  // the faster they fly, the wider
  EXPECT_LT(settles_at(1e-4, 2000), 0.05);
  EXPECT_FALSE(SkinTuner(diameter, 0).tunes());
}

TEST(Simd, TransposesAndItsInverseKeepEveryElement) {
  std::array<Pack<native_lanes>, 8> columns = columns_of_eight<native_lanes>([](int l, int part) {
    Pack<native_lanes> row;
    for (int k = 0; k < native_lanes; ++k) row[k] = 10 * l + part + k;
    return row;
  });
  for (int c = 0; c < 8; ++c)
    for (int l = 0; l < native_lanes; ++l) EXPECT_EQ(columns[c][l], 10 * l + c);
  int seen = 0;
  rows_of_eight<native_lanes>(columns, [&](int l, int part, const Pack<native_lanes>& row) {
    for (int k = 0; k < native_lanes; ++k, ++seen) EXPECT_EQ(row[k], 10 * l + part + k);
  });
  EXPECT_EQ(seen, 8 * native_lanes);
}

TEST(Simd, CopySetKeepsTheOrderOfWhatIsChosen) {
  const std::uint64_t values[8] = {10, 11, 12, 13, 14, 15, 16, 17};
  for (unsigned bits = 0; bits < 1u << native_lanes; ++bits) {
    std::uint64_t out[8 + native_lanes] = {};
    const std::size_t count = copy_set<native_lanes>(values, bits, out);
    std::size_t expected = 0;
    for (int l = 0; l < native_lanes; ++l)
      if (bits >> l & 1) {
        ASSERT_LT(expected, count);
        EXPECT_EQ(out[expected++], values[l]);
      }
    EXPECT_EQ(count, expected);
  }
}

}  // namespace
}  // namespace bedflow
