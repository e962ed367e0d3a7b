#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/dem_scene.h"

namespace bedflow {
namespace {

constexpr double gravity = 9.81;
const Vec3 box{0.04, 0.04, 0.04};

// ---------------------------------------------------------------------------------------------------- rebound

// Speed after over speed before, mean over 200 phases of first contact within a sub-step.
double mean_restitution(bool on_wall, double restitution, int steps_per_time) {
  Spheres spheres;
  spheres.restitution = restitution;
  Scene<Frictionless> scene(Comm::self(), box, spheres);
  const double speed = 0.5, radius = spheres.diameter / 2;
  const double dt = spheres.contact().collision_time(spheres.mass() / (on_wall ? 1 : 2)) / steps_per_time;
  double sum = 0;
  for (int phase = 0; phase < 200; ++phase) {
    const double gap = (0.3 + phase / 200.0) * speed * dt;
    if (on_wall) {
      scene.place({{{radius + gap, 0.02, 0.02}, {-speed, 0, 0}, {}}});
    } else {
      scene.place({{{0.02, 0.02, 0.02}, {speed / 2, 0, 0}, {}}, {{0.02 + 2 * radius + gap, 0.02, 0.02}, {-speed / 2, 0, 0}, {}}});
    }
    scene.advance(2 * steps_per_time, dt);
    const auto after = scene.gathered();
    sum += (on_wall ? after.at(0).velocity.x : after.at(1).velocity.x - after.at(0).velocity.x) / speed;
  }
  return sum / 200;
}

TEST(Contact, ReboundSpeedIsRestitutionTimesImpactSpeed) {
  for (const bool on_wall : {false, true})
    for (const double e : {0.8, 0.9, 0.97}) {
      EXPECT_NEAR(mean_restitution(on_wall, e, 20), e, 0.003 * e) << e;  // the scatter of the phase averages out
      EXPECT_NEAR(mean_restitution(on_wall, e, 50), e, 0.001 * e) << e;
    }
}

// Symplectic Euler takes the dashpot's velocity at the old time: a bias of first order that grows with |ln e|.
TEST(Contact, TheBiasOfAStronglyDampedReboundIsOfFirstOrder) {
  for (const bool on_wall : {false, true}) {
    const double coarse = mean_restitution(on_wall, 0.66, 20) - 0.66, fine = mean_restitution(on_wall, 0.66, 100) - 0.66;
    EXPECT_NEAR(coarse / fine, 5, 1);  // 200 phases leave a tenth of the scatter in the mean
    EXPECT_LT(std::abs(coarse), 0.004 * 0.66);
  }
}

// ---------------------------------------------------------------------------------------------------- dropped ball

// Exact height and velocity of a ball dropped from h0: fall, contact (k and η of a wall), rebound.
struct DroppedBall {
  double h0, radius, mass, stiffness, damping;

  struct State {
    double y, v;
  };
  State in_contact(double s) const {
    const double w0 = std::sqrt(stiffness / mass), beta = damping / (2 * std::sqrt(stiffness * mass));
    const double wd = w0 * std::sqrt(1 - beta * beta), decay = beta * w0, rest = gravity / (w0 * w0);
    const double speed = std::sqrt(2 * gravity * (h0 - radius));
    const double a = rest, b = (beta * gravity / w0 - speed) / wd, c = std::cos(wd * s), d = std::sin(wd * s);
    return {radius - rest + std::exp(-decay * s) * (a * c + b * d),
            std::exp(-decay * s) * ((b * wd - decay * a) * c - (a * wd + decay * b) * d)};
  }
  double impact() const { return std::sqrt(2 * (h0 - radius) / gravity); }
  double contact_time() const {  // root of y = radius near the half period
    double low = 0.5 * std::numbers::pi * std::sqrt(mass / stiffness), high = 3 * low;
    while (high - low > 1e-15) (in_contact(0.5 * (low + high)).y < radius ? low : high) = 0.5 * (low + high);
    return low;
  }
  State at(double t) const {
    if (t < impact()) return {h0 - 0.5 * gravity * t * t, -gravity * t};
    const double s = t - impact(), end = contact_time();
    if (s < end) return in_contact(s);
    const double v = in_contact(end).v, flight = s - end;
    return {radius + v * flight - 0.5 * gravity * flight * flight, v - gravity * flight};
  }
};

// Root-mean-square error of the height over 60 drops, about `after` collision times from the impact.
double drop_error(double steps_per_time, double after) {
  Spheres spheres;
  spheres.restitution = 0.8;
  spheres.gravity = {0, -gravity, 0};
  Scene<Frictionless> scene(Comm::self(), box, spheres);
  const LinearSpringDashpot law = spheres.contact();
  const double time = law.collision_time(spheres.mass()), dt = time / steps_per_time;
  std::mt19937_64 random(1);
  double sum = 0;
  for (int drop = 0; drop < 60; ++drop) {
    const double h0 = 1.5e-3 + 4e-4 * 0x1p-64 * static_cast<double>(random());  // any phase of first contact
    const DroppedBall exact{h0, spheres.diameter / 2, spheres.mass(), law.stiffness, law.damping(spheres.mass())};
    const int steps = static_cast<int>(std::ceil((exact.impact() + after * time) / dt));
    scene.place({{{0.02, h0, 0.02}, {}, {}}});
    scene.advance(steps, dt);
    sum += std::pow(scene.gathered().at(0).position.y - exact.at(steps * dt).y, 2);
  }
  return std::sqrt(sum / 60);
}

TEST(DroppedBall, FollowsTheThreeStageSolutionToFirstOrderInTheSubStep) {
  for (const double after : {0.5, 20.0}) {  // in contact, and on the way up
    const double order = std::log(drop_error(20, after) / drop_error(640, after)) / std::log(32);
    EXPECT_NEAR(order, 1, 0.2) << after;  // the rebound depends on the phase of first contact: scatter about the slope
    EXPECT_LT(drop_error(20, after), 2e-3 * Spheres{}.diameter) << after;
  }
}

// ---------------------------------------------------------------------------------------------------- two stacked spheres

// Heights of two spheres pressed between floor and lid, by RK4 of  m y'' = Σ k δ + η δ' − m g.
std::array<double, 4> stacked_exact(std::array<double, 4> state, double lid, const Spheres& spheres, double time, int steps) {
  const auto law = spheres.contact();
  const double m = spheres.mass(), d = spheres.diameter;
  const auto rate = [&](const std::array<double, 4>& s) {
    const auto force = [&](double mass, double overlap, double approach) {
      return overlap > 0 ? law(Touching<double>{overlap, approach, mass, 0}) : 0;
    };
    const double floor = force(m, d / 2 - s[0], -s[1]), between = force(m / 2, d - (s[2] - s[0]), s[1] - s[3]),
                 top = force(m, d / 2 - (lid - s[2]), s[3]);
    return std::array<double, 4>{s[1], (floor - between) / m - gravity, s[3], (between - top) / m - gravity};
  };
  const auto moved = [](std::array<double, 4> s, const std::array<double, 4>& k, double h) {
    for (int i = 0; i < 4; ++i) s[i] += h * k[i];
    return s;
  };
  const double h = time / steps;
  for (int n = 0; n < steps; ++n) {
    const auto k1 = rate(state), k2 = rate(moved(state, k1, h / 2)), k3 = rate(moved(state, k2, h / 2)),
               k4 = rate(moved(state, k3, h));
    for (int i = 0; i < 4; ++i) state[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  return state;
}

TEST(StackedPair, FollowsTheEquationsOfMotion) {
  for (const double e : {0.5, 0.8, 1.0}) {
    Spheres spheres;
    spheres.restitution = e;
    spheres.gravity = {0, -gravity, 0};
    const double d = spheres.diameter, lid = 1.9 * d, time = 5 * spheres.collision_time();
    const std::array<double, 4> start{0.48 * d, 0, 1.41 * d, 0};
    const auto exact = stacked_exact(start, lid, spheres, time, 20000);
    std::array<double, 2> lower{}, upper{};
    for (const int halved : {0, 1}) {
      Scene<Frictionless> scene(Comm::self(), {0.04, lid, 0.04}, spheres, {8, 1, 8});
      scene.place({{{0.02, start[0], 0.02}, {}, {}}, {{0.02, start[2], 0.02}, {}, {}}});
      const int steps = 20000 << halved;
      scene.advance(steps, time / steps);
      lower[halved] = scene.gathered().at(0).position.y;
      upper[halved] = scene.gathered().at(1).position.y;
    }
    // First order: the error halves with the sub-step, and what is left after extrapolation is of second order.
    EXPECT_NEAR(lower[1], exact[0], 2e-4 * d) << e;
    EXPECT_NEAR(2 * lower[1] - lower[0], exact[0], 6e-6 * exact[0]) << e;
    EXPECT_NEAR(2 * upper[1] - upper[0], exact[2], 6e-6 * exact[2]) << e;
  }
}

// ---------------------------------------------------------------------------------------------------- sliding and rolling

template <class Law>
class Friction : public testing::Test {};
using Laws = testing::Types<Coulomb, TangentialSpring>;
TYPED_TEST_SUITE(Friction, Laws);

// A stiff ball that rests on the floor in balance with its weight and slides with u0.
struct SlidingBall : Spheres {
  double u0 = 0.1;
  SlidingBall(double mu) {
    diameter = 0.01;
    density = 2500;
    stiffness = 2.6e5;
    friction = mu;
    restitution = 0.8;
    gravity = {0, -bedflow::gravity, 0};
    skin = 1e-3;
  }
  double roll_time() const { return 2 * u0 / (7 * friction * bedflow::gravity); }
  double dt() const { return contact().collision_time(mass()) / 50; }
  PlacedSphere start(Vec3 place) const {
    place.y = diameter / 2 - mass() * bedflow::gravity / stiffness;
    return {place, {u0, 0, 0}, {}};
  }
};

TYPED_TEST(Friction, ASlidingSphereRollsAtFiveSeventhsOfItsSpeed) {
  for (const double mu : {0.2, 0.5, 1.0}) {
    const SlidingBall ball(mu);
    Scene<TypeParam> scene(Comm::self(), {0.2, 0.1, 0.1}, ball);
    scene.place({ball.start({0.05, 0, 0.05})});
    double rolled = 0;
    const double dt = ball.dt();
    for (int n = 0; n < 100000 && rolled == 0; ++n) {
      scene.advance(1, dt);
      const Particle p = scene.gathered().at(0);
      if (p.velocity.x + ball.diameter / 2 * p.spin.z <= 1e-3 * ball.u0) rolled = (n + 1) * dt;
    }
    EXPECT_NEAR(rolled, ball.roll_time(), 0.006 * ball.roll_time() + dt) << mu;
    scene.advance(4000, dt);
    const Particle p = scene.gathered().at(0);
    EXPECT_NEAR(p.velocity.x, 5 * ball.u0 / 7, 2e-4 * ball.u0) << mu;
    EXPECT_NEAR(-ball.diameter / 2 * p.spin.z, p.velocity.x, 2e-4 * ball.u0) << mu;  // rolls about −z
  }
}

struct Oblique {
  double tangential, normal, spin;  // speeds after over the ones before (spin: R ω over the normal speed)
};
template <class Law>
Oblique impact(double degrees, const Spheres& spheres) {
  Scene<Law> scene(Comm::self(), box, spheres);
  const double angle = degrees * std::numbers::pi / 180, vn = 0.02 * std::cos(angle), vt = 0.02 * std::sin(angle);
  const double time = spheres.contact().collision_time(spheres.mass());
  scene.place({{{0.02, spheres.diameter / 2 + 1e-9, 0.02}, {vt, -vn, 0}, {}}});
  scene.advance(300, time / 200);
  const Particle p = scene.gathered().at(0);
  return {p.velocity.x / vt, p.velocity.y / vn, -spheres.diameter / 2 * p.spin.z / vn};
}

TYPED_TEST(Friction, TheSlidingBranchOfAnObliqueImpactIsExact) {
  for (const double degrees : {35.0, 45.0, 55.0, 65.0}) {
    const Spheres spheres;
    const Oblique after = impact<TypeParam>(degrees, spheres);
    // Tolerance: the normal force ends attractive, a share (ln e/π)² = 1e-4 of the impulse, and the arm is short by δ/R = 1e-3.
    const double impulse = 1 + after.normal;
    EXPECT_NEAR(after.tangential, 1 - spheres.friction * impulse / std::tan(degrees * std::numbers::pi / 180), 3e-4) << degrees;
    EXPECT_NEAR(after.spin, 2.5 * spheres.friction * impulse, 2e-3 * after.spin) << degrees;
  }
}

TEST(Coulomb, BelowTheCriticalAngleTheSphereLeavesRolling) {
  const Oblique after = impact<Coulomb>(10, Spheres{});  // tan 10° < 3.5 μf (1 + e) = 0.69
  EXPECT_NEAR(after.tangential, 5.0 / 7, 1e-3);          // no memory: it cannot reverse as a sticking contact would
}

TEST(Wall, ACornerCountsEachOfItsThreePlanesOnce) {
  Spheres spheres;
  Scene<Frictionless> scene(Comm::self(), box, spheres);
  const double inside = spheres.diameter / 2 - 1e-6, dt = 1e-7;
  scene.place({{{inside, inside, box.z - inside}, {}, {}}});
  scene.advance(1, dt);
  const Vec3 v = scene.gathered().at(0).velocity;
  const double kick = spheres.stiffness * 1e-6 * dt / spheres.mass();
  EXPECT_NEAR(v.x, kick, 1e-9 * kick);
  EXPECT_NEAR(v.y, kick, 1e-9 * kick);
  EXPECT_NEAR(v.z, -kick, 1e-9 * kick);
}

}  // namespace
}  // namespace bedflow
