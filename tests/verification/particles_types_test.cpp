// Several types and sizes in one crowd, and both integrators. On any number of ranks.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "particles/dem.h"
#include "support/touching_pairs.h"

namespace bedflow {
namespace {

struct Sphere {
  Vec3 position, velocity, spin;
  double radius = 0, mass = 0;
};

// A crowd of three types: small and large ones of one size each (1 : 5), and others of any size between them.
class Mixture {
 public:
  static constexpr double edge = 0.012;

  Mixture(ContactLaws laws, bool periodic, int small, int large, int any, double speed, double skin)
      : decomposition_(Comm::world(), {6, 6, 6}, {edge, edge, edge}, {periodic, periodic, periodic}),
        dem(decomposition_, setup(periodic, skin), std::move(laws), timer_) {
    std::mt19937_64 random(17);
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * 0x1p-53 * static_cast<double>(random() >> 11);
    };
    std::vector<Sphere> placed;
    ParticleStore store;
    for (int n = 0; n < large + any + small; ++n) {  // the largest first
      const int type = n < large ? 1 : n < large + any ? 2 : 0;
      const double r = type == 1 ? 1e-3 : type == 2 ? uniform(2e-4, 9e-4) : 2e-4;
      Vec3 place;
      const auto clear = [&] {
        return std::ranges::all_of(placed, [&](const Sphere& other) { return norm(place - other.position) > r + other.radius; });
      };
      do place = {uniform(r, edge - r), uniform(r, edge - r), uniform(r, edge - r)};
      while (!clear());
      const Vec3 velocity{uniform(-speed, speed), uniform(-speed, speed), uniform(-speed, speed)};
      placed.push_back({place, velocity, {}, r, 0});
      if (decomposition_.owner(place) != decomposition_.comm().rank()) continue;
      store.add(n, place, velocity, {});
      store.type.push_back(static_cast<std::uint8_t>(type));
      store.radius.push_back(r);
    }
    dem.set_particles(std::move(store));
  }

  std::map<std::int64_t, Sphere> gathered() const {
    std::vector<double> mine;
    const ParticleStore& p = dem.particles();
    for (std::size_t i = 0; i < p.owned; ++i) {
      mine.insert(mine.end(),
                  {static_cast<double>(p.id[i]), radius_of(dem.setup().types, p, i), mass_of(dem.setup().types, p, i)});
      for (const Vec3 v : {p.position(i), p.velocity(i), p.spin(i)}) mine.insert(mine.end(), {v.x, v.y, v.z});
    }
    const std::vector<double> all = decomposition_.comm().gather_all(mine);
    std::map<std::int64_t, Sphere> result;
    for (auto r = all.begin(); r != all.end(); r += 12)
      result[static_cast<std::int64_t>(r[0])] = {{r[3], r[4], r[5]}, {r[6], r[7], r[8]}, {r[9], r[10], r[11]}, r[1], r[2]};
    return result;
  }
  const Comm& comm() const { return decomposition_.comm(); }

 private:
  static DemSetup setup(bool periodic, double skin) {
    DemSetup result;
    result.types = {{2e-4, 2500, false}, {1e-3, 1500, false}, {9e-4, 2000, true}};
    result.skin = skin;
    for (auto& sides : result.sides)
      sides = periodic ? std::array{Side::periodic, Side::periodic} : std::array{Side::wall, Side::wall};
    return result;
  }

  Decomposition decomposition_;
  PhaseTimer timer_;

 public:
  Dem dem;
};

template <class Law>
LawTable<Law> for_three(const Law& law) {
  return {std::vector<Law>(6, law), std::vector<Law>(3, law)};
}

ContactLaws linear() {
  const auto contact = LinearSpringDashpot::from_restitution(500, 0.9);
  ContactLaws laws;
  laws.contact = for_three(contact);
  laws.tangential = for_three(TangentialSpring::from_normal(0.4, contact));
  laws.rolling = for_three(SpringRolling{0.05, 500, 0.3});
  return laws;
}
ContactLaws hertzian() {
  ContactLaws laws;
  laws.contact = for_three(Hertz::from_restitution(1e7, 0.9));
  laws.tangential = for_three(Mindlin{0.4, 3e6, damping_share(0.9)});
  laws.rolling = for_three(ConstantRolling{0.05});
  laws.cohesion = for_three(VanDerWaals{1e-13, 1e-8, 1e-4});
  return laws;
}
// A twentieth of the impact of the lightest pair: τ = π √(m*/k).
constexpr double small_mass = 4 * std::numbers::pi / 3 * 2500 * 8e-12;
const double sub_step = std::numbers::pi * std::sqrt(small_mass / 2 / 500) / 20;

TEST(Types, MomentumIsConservedAcrossPeriodicFacesWhateverTheLaws) {
  for (const ContactLaws& laws : {linear(), hertzian()}) {
    Mixture crowd(laws, true, 900, 20, 120, 0.3, 2e-4);
    const auto momentum = [](const std::map<std::int64_t, Sphere>& spheres) {
      Vec3 sum;
      for (const auto& [id, s] : spheres) sum += s.mass * s.velocity;
      return sum;
    };
    const auto before = crowd.gathered();
    double scale = 0;
    for (const auto& [id, s] : before) scale += s.mass * norm(s.velocity);
    crowd.dem.advance(800, sub_step);
    const auto after = crowd.gathered();
    ASSERT_EQ(after.size(), 1040u);
    EXPECT_GT(crowd.comm().max(crowd.dem.max_overlap()), 1e-3);
    EXPECT_LT(norm(momentum(after) - momentum(before)), 2e-13 * scale);  // 800 sub-steps of round-off
    for (const auto& [id, s] : after) EXPECT_EQ(s.radius, before.at(id).radius) << id;
  }
}

// Without walls: what spins and orbits the crowd has in all, while rolling resistance turns one pair of bodies against each
// other.
TEST(Types, AngularMomentumIsConserved) {
  Mixture crowd(linear(), true, 300, 6, 40, 0.05, 2e-4);
  const auto turn = [](const std::map<std::int64_t, Sphere>& spheres, double& scale) {
    Vec3 sum;
    scale = 0;
    for (const auto& [id, s] : spheres) {
      const Vec3 own = cross(s.position, s.mass * s.velocity) + inertia_of(s.mass, s.radius) * s.spin;
      sum += own;
      scale += norm(own);
    }
    return sum;
  };
  double scale = 0;
  const auto before = crowd.gathered();
  // A short time in which none touches through a periodic face: all that stand near one are still.
  std::map<std::int64_t, Sphere> inner;
  const Vec3 start = turn(before, scale);
  int touched = 0;
  for (int n = 0; n < 40; ++n) {
    crowd.dem.advance(5, sub_step);
    touched += crowd.comm().sum(crowd.dem.contact_count()) > 0;
    const auto now = crowd.gathered();
    bool across = false;
    for (const auto& [i, a] : now)
      for (const auto& [j, b] : now) {
        if (i >= j) continue;
        Vec3 apart = b.position - a.position;
        const double direct = norm(apart);
        for (int d = 0; d < 3; ++d) apart[d] -= Mixture::edge * std::round(apart[d] / Mixture::edge);
        across = across || (norm(apart) < a.radius + b.radius + 2e-5 && direct > a.radius + b.radius + 2e-5);
      }
    if (across) break;
    EXPECT_LT(norm(turn(now, scale) - start), 1e-13 * scale) << n;
  }
  EXPECT_GT(touched, 0);
}

// The smallest beside the largest, 1 : 5, fast and with a thin skin: the pairs that touch are those that brute force finds.
TEST(Types, NoContactIsEverMissed) {
  for (const bool periodic : {false, true}) {
    Mixture crowd(linear(), periodic, 500, 10, 60, 1.5, 5e-5);
    std::int64_t met = 0;
    for (int n = 0; n < 250; ++n) {
      const auto spheres = crowd.gathered();
      const auto both = [](const Sphere& a, const Sphere& b) { return a.radius + b.radius; };
      const std::int64_t expected = touching_pairs(spheres, both, periodic ? Mixture::edge : 0);
      crowd.dem.advance(1, sub_step);
      ASSERT_EQ(crowd.comm().sum(crowd.dem.contact_count()), expected) << "sub-step " << n;
      met += expected;
    }
    EXPECT_GT(met, 500);
    EXPECT_GT(crowd.dem.rebuilds(), 20);
    EXPECT_LT(crowd.dem.rebuilds(), 240);  // by displacement, not every sub-step
  }
}

// ---------------------------------------------------------------------------------------------------- integrators

// Height of a ball that oscillates in a damped contact with the floor, pressed by its weight, against the exact solution.
double contact_error(bool verlet, double steps_per_time) {
  constexpr double mass_density = 2000, radius = 1e-3, gravity = 9.81;
  const auto law = LinearSpringDashpot::from_restitution(800, 0.6);
  DemSetup setup{.types = {{radius, mass_density, false}}, .gravity = {0, -gravity, 0}, .skin = 2e-4, .verlet = verlet};
  const double mass = setup.types[0].mass(), time = law.collision_time(mass), dt = time / steps_per_time;
  const Decomposition decomposition(Comm::self(), {4, 4, 4}, {0.01, 0.01, 0.01}, {false, false, false});
  PhaseTimer timer;
  ContactLaws laws;
  laws.contact = LawTable<LinearSpringDashpot>{{law}, {law}};
  laws.tangential = LawTable<Frictionless>{{{}}, {{}}};
  Dem dem(decomposition, setup, laws, timer);
  ParticleStore one;
  const double overlap = 2e-5;
  one.add(0, {0.005, radius - overlap, 0.005}, {}, {});
  dem.set_particles(std::move(one));
  const int steps = static_cast<int>(steps_per_time * 0.4);
  dem.advance(steps, dt);
  const double t = steps * dt, w0 = std::sqrt(800 / mass), decay = law.damping_share * w0;
  const double w = w0 * std::sqrt(1 - law.damping_share * law.damping_share), rest = mass * gravity / 800;
  const double swing = overlap - rest;  // from rest at the overlap: swing e^(−λt) (cos ωt + λ/ω sin ωt)
  const double exact = rest + swing * std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
  return std::abs(radius - dem.particles().position(0).y - exact) / overlap;
}

TEST(Integrator, SymplecticEulerIsOfFirstOrderAndVelocityVerletOfSecondWithADashpot) {
  EXPECT_NEAR(std::log2(contact_error(false, 80) / contact_error(false, 160)), 1, 0.05);
  EXPECT_NEAR(std::log2(contact_error(true, 80) / contact_error(true, 160)), 2, 0.1);
  EXPECT_LT(contact_error(true, 20), 0.1 * contact_error(false, 20));
}

// A thrown ball falls on the exact parabola, and two that pass through each other's spring part with e.
TEST(Integrator, VelocityVerletFallsExactly) {
  DemSetup setup{.types = {{1e-3, 2000, false}}, .gravity = {0, -9.81, 0}, .skin = 2e-4, .verlet = true};
  const Decomposition decomposition(Comm::self(), {4, 4, 4}, {0.1, 0.1, 0.1}, {false, false, false});
  PhaseTimer timer;
  ContactLaws laws;
  laws.contact = LawTable<LinearSpringDashpot>{{{800, 0}}, {{800, 0}}};
  laws.tangential = LawTable<Frictionless>{{{}}, {{}}};
  Dem dem(decomposition, setup, laws, timer);
  ParticleStore one;
  one.add(0, {0.05, 0.05, 0.05}, {0.1, 0.2, 0}, {});
  dem.set_particles(std::move(one));
  dem.advance(100, 1e-4);
  EXPECT_NEAR(dem.particles().position(0).y, 0.05 + 0.2 * 0.01 - 0.5 * 9.81 * 1e-4, 1e-16);  // 100 roundings of 0.05
  EXPECT_NEAR(dem.particles().velocity(0).y, 0.2 - 9.81 * 0.01, 1e-15);
}

}  // namespace
}  // namespace bedflow
