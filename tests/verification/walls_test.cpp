// Particles on walls of every kind, at rest and moving: exact trajectories.
#include <gtest/gtest.h>

#include "geometry/cut_cells.h"
#include "support/dem_scene.h"
#include "support/shapes.h"

namespace bedflow {
namespace {

constexpr double gravity = 9.81;
const Vec3 box{0.04, 0.04, 0.04};

Spheres one_ball(double friction, Surface surface, Motion motion = Still{}) {
  Spheres spheres;
  spheres.gravity = {0, -gravity, 0};
  spheres.friction = friction;
  spheres.restitution = 0.5;
  spheres.walls = {{"wall", std::move(surface), std::move(motion)}};
  return spheres;
}
double sub_step(const Spheres& spheres) {
  return spheres.contact().collision_time(spheres.mass()) / 50;
}
double overlap_at(const Spheres& spheres, double push) {  // δ that bears a force of `push` times the mass
  return spheres.mass() * push / spheres.stiffness;
}

// ---------------------------------------------------------------------------------------------------- tilted plane

const Vec3 slope_normal = 1 / std::sqrt(0.94) * Vec3{0.3, 0.9, 0.2};
const Plane slope{slope_normal, dot(slope_normal, Vec3{0.02, 0.02, 0.02})};

// The plane itself, as a mesh of many triangles, and as the cells of a grid cut it.
std::vector<Surface> slopes() {
  Vec3 along = cross(slope_normal, Vec3{0, 0, 1});
  along *= 0.1 / norm(along);
  const Vec3 across = cross(along, slope_normal);
  return {slope, Mesh(tessellated(Vec3{0.02, 0.02, 0.02} - 0.5 * along - 0.5 * across, along, across, 37, 41)),
          Mesh(cut_cells(slope, {20, 20, 20}, 1.0 / 20 * box))};
}

// A ball let go at the top of the slope; the end of its run of 12 mm or so.
Particle run_down(const Surface& surface, double friction, double duration, std::int64_t* rebuilds = nullptr) {
  const Spheres spheres = one_ball(friction, surface);
  Scene<TangentialSpring> scene(Comm::self(), box, spheres);
  const double height = spheres.diameter / 2 - overlap_at(spheres, gravity * slope_normal.y);
  const Vec3 start = Vec3{0.01, 0.02, 0.0183} + (height - slope.distance({0.01, 0.02, 0.0183})) * slope_normal;
  scene.place({{start, {}, {}}});
  scene.advance(static_cast<int>(duration / sub_step(spheres)), sub_step(spheres));
  if (rebuilds) *rebuilds = scene.dem.rebuilds();
  Particle end = scene.gathered().at(0);
  end.position -= start;
  return end;
}

double slope_pull() {  // g sin θ
  const Vec3 g{0, -gravity, 0};
  return norm(g - dot(g, slope_normal) * slope_normal);
}

TEST(TiltedPlane, ABallThatSticksRollsDownWithFiveSevenths) {
  const double duration = 0.09;
  const Spheres spheres = one_ball(0.5, slope);
  const double time = std::floor(duration / sub_step(spheres)) * sub_step(spheres);
  // ½ a t² of symplectic Euler is ½ a t (t + dt); the friction's arm is r − δ: a = g sin θ/(1 + (2/5) (r/(r − δ))²).
  const double arm = 1 - overlap_at(spheres, gravity * slope_normal.y) / (spheres.diameter / 2);
  const double exact = 0.5 * slope_pull() / (1 + 0.4 / (arm * arm)) * time * (time + sub_step(spheres));
  EXPECT_GT(exact, 10 * spheres.diameter / 2);
  for (const Surface& surface : slopes()) {
    std::int64_t rebuilds = 0;
    const Particle end = run_down(surface, 0.5, duration, &rebuilds);
    EXPECT_GT(rebuilds, 20);
    // The spring is not loaded at first: the ball is ahead by no more than what loads it, m g sin θ (2/7)/kt = g sin θ m/k.
    EXPECT_NEAR(norm(end.position), exact, 2 * overlap_at(spheres, slope_pull())) << surface.index();
    EXPECT_NEAR(norm(end.velocity), 5.0 / 7 * slope_pull() * time, 1e-4 * norm(end.velocity));
    EXPECT_NEAR(norm(end.spin) * spheres.diameter / 2, norm(end.velocity),
                3e-4 * norm(end.velocity));  // the overlap shortens the arm
    EXPECT_NEAR(slope.distance(end.position) + slope.offset, 0, 1e-9);
  }
}

TEST(TiltedPlane, ABallThatSlipsSlidesDown) {
  const double friction = 0.05, duration = 0.07;
  const Spheres spheres = one_ball(friction, slope);
  const double time = std::floor(duration / sub_step(spheres)) * sub_step(spheres);
  const double rub = friction * gravity * slope_normal.y, pull = slope_pull() - rub;
  EXPECT_GT(slope_pull(), 3.5 * rub);  // it cannot stick
  for (const Surface& surface : slopes()) {
    const Particle end = run_down(surface, friction, duration);
    EXPECT_NEAR(norm(end.velocity), pull * time, 1e-4 * pull * time);
    EXPECT_NEAR(norm(end.spin), 2.5 * rub / (spheres.diameter / 2) * time, 3e-4 * norm(end.spin));
  }
}

// However many facets bear the ball, the trajectory is that on the plane. Places of facets are known to 1e-17 m, a normal to that
// over a radius; along the run that turns the gravity by 1e-14 and moves the ball by 1e-16 m; its contact oscillates about a
// force known to k 1e-17.
TEST(TiltedPlane, MeshAndCutCellsAreThePlane) {
  for (const double friction : {0.5, 0.05}) {
    const std::vector<Surface> surfaces = slopes();
    const Particle exact = run_down(surfaces[0], friction, 0.05);
    for (const Surface& surface : {surfaces[1], surfaces[2]}) {
      const Particle end = run_down(surface, friction, 0.05);
      EXPECT_LE(norm(end.position - exact.position), 1e-13);
      EXPECT_LE(norm(end.velocity - exact.velocity), 1e-11);
      EXPECT_LE(norm(end.spin - exact.spin) * 6e-4, 1e-11);
    }
  }
}

// ---------------------------------------------------------------------------------------------------- curved walls

// A ball that rolls without slipping in a tube is a pendulum: φ'' = −(5/7) g/(R − r) sin φ.
double pendulum(double length, double angle, double time) {
  const auto pull = [&](double a) { return -5.0 / 7 * gravity / length * std::sin(a); };
  double rate = 0;
  const int steps = 20000;
  const double dt = time / steps;
  for (int n = 0; n < steps; ++n) {  // Runge–Kutta of fourth order
    const double r1 = rate, a1 = pull(angle), r2 = rate + dt / 2 * a1, a2 = pull(angle + dt / 2 * r1);
    const double r3 = rate + dt / 2 * a2, a3 = pull(angle + dt / 2 * r2), r4 = rate + dt * a3, a4 = pull(angle + dt * r3);
    angle += dt / 6 * (r1 + 2 * r2 + 2 * r3 + r4);
    rate += dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return angle;
}

Mesh tube_of_flats(double radius, int flats) {
  std::vector<Facet> facets;
  const auto at = [&](int n) {
    const double turn = 2 * std::numbers::pi * n / flats;
    return Vec3{0.02 + radius * std::cos(turn), 0.02 + radius * std::sin(turn), -0.01};
  };
  for (int k = 0; k < flats; ++k) {
    const auto strip = tessellated(at(k), at(k + 1) - at(k), {0, 0, 0.06}, 1, 7);
    facets.insert(facets.end(), strip.begin(), strip.end());
  }
  return Mesh(facets);
}

double angle_in_tube(const Surface& surface, double radius, double angle, double duration) {
  const Spheres spheres = one_ball(1, surface);
  Scene<TangentialSpring> scene(Comm::self(), box, spheres);
  const double length = radius - spheres.diameter / 2 + overlap_at(spheres, gravity * std::cos(angle));
  scene.place({{{0.02 + length * std::sin(angle), 0.02 - length * std::cos(angle), 0.0203}, {}, {}}});
  scene.advance(static_cast<int>(duration / sub_step(spheres)), sub_step(spheres));
  const Vec3 end = scene.gathered().at(0).position;
  EXPECT_NEAR(end.z, 0.0203, 1e-9);
  return std::atan2(end.x - 0.02, 0.02 - end.y);
}

TEST(Tube, ABallRollsInItAsAPendulum) {
  const double radius = 0.01, start = 0.8, duration = 0.1;
  const double exact = pendulum(radius - 0.6e-3, start, duration);
  EXPECT_LT(exact, -0.2);  // it has passed the bottom
  const Revolved tube = Revolved::cylinder({0.02, 0.02, -0.01}, {0.02, 0.02, 0.05}, radius, false);
  // Spring and dashpot take the ball's start to heart: 1e-3 of the swing.
  EXPECT_NEAR(angle_in_tube(tube, radius, start, duration), exact, 2e-3);
  EXPECT_NEAR(angle_in_tube(tube_of_flats(radius, 720), radius, start, duration), exact, 1e-2);
}

// ---------------------------------------------------------------------------------------------------- moving walls

TEST(Belt, ABallLaidOnItRollsWithTwoSeventhsOfItsSpeed) {
  const double speed = 0.1, friction = 0.3, duration = 0.06;
  const Spheres spheres = one_ball(friction, Plane{{0, 1, 0}, 0.01}, Translation{{speed, 0, 0}});
  Scene<TangentialSpring> scene(Comm::self(), box, spheres);
  scene.place({{{0.01, 0.01 + spheres.diameter / 2 - overlap_at(spheres, gravity), 0.02}, {}, {}}});
  const double rolls_at = 2 * speed / (7 * friction * gravity), dt = sub_step(spheres);
  const int half = static_cast<int>(0.5 * rolls_at / dt);
  scene.advance(half, dt, 0.0);
  EXPECT_NEAR(scene.gathered().at(0).velocity.x, friction * gravity * half * dt, 2e-3 * speed);
  scene.advance(static_cast<int>(duration / dt), dt, half * dt);
  const Particle end = scene.gathered().at(0);
  EXPECT_NEAR(end.velocity.x, 2.0 / 7 * speed, 1e-3 * speed);
  EXPECT_NEAR(end.velocity.x + spheres.diameter / 2 * end.spin.z, speed, 1e-3 * speed);
}

TEST(Drum, ABallAtTheBottomTurnsWithIt) {
  const double radius = 0.015, rate = 8;
  const Spheres spheres = one_ball(0.5, Revolved::cylinder({0.02, 0.02, -0.01}, {0.02, 0.02, 0.05}, radius, false),
                                   Rotation{{0.02, 0.02, 0}, {0, 0, 1}, rate});
  Scene<TangentialSpring> scene(Comm::self(), box, spheres);
  const double r = spheres.diameter / 2, dt = sub_step(spheres);
  // Rolling in place: ω r = Ω R, the same way round.
  scene.place({{{0.02, 0.02 - radius + r - overlap_at(spheres, gravity), 0.02}, {}, {0, 0, rate * radius / r}}});
  scene.dem.take_wall_loads();
  scene.advance(20000, dt, 0.0);
  const Particle end = scene.gathered().at(0);
  EXPECT_NEAR(end.position.x, 0.02, 2e-6);
  EXPECT_NEAR(end.spin.z * r, rate * radius, 1e-3 * rate * radius);
  const WallLoad load = scene.dem.take_wall_loads()[6];
  EXPECT_NEAR(load.force.y, -spheres.mass() * gravity, 1e-3 * spheres.mass() * gravity);
  EXPECT_NEAR(load.torque.z, 0, 1e-3 * spheres.mass() * gravity * radius);

  // From rest it is carried up the rising side, and holds the drum back.
  scene.place({{{0.02, 0.02 - radius + r - overlap_at(spheres, gravity), 0.02}, {}, {}}});
  scene.advance(400, dt, 0.0);
  EXPECT_GT(scene.gathered().at(0).position.x, 0.02);
  EXPECT_NEAR(scene.dem.take_wall_loads()[6].torque.z, -0.5 * spheres.mass() * gravity * radius,
              0.03 * spheres.mass() * gravity * radius);
}

// Γ = A(2πf)²/g < 1: the ball stays on the floor. Γ > 1: it leaves where the floor's acceleration reaches −g, and flies.
TEST(VibratingFloor, CarriesTheBallBelowGAndThrowsItAbove) {
  const double frequency = 30, rate = 2 * std::numbers::pi * frequency;
  for (const double strength : {0.5, 2.0}) {
    const double amplitude = strength * gravity / (rate * rate);
    Spheres spheres = one_ball(0, Plane{{0, 1, 0}, 0.01}, Vibration{{0, amplitude, 0}, frequency, 0});
    spheres.stiffness = 4400;
    Scene<Frictionless> scene(Comm::self(), box, spheres);
    const double rest = 0.01 + spheres.diameter / 2 - overlap_at(spheres, gravity), dt = sub_step(spheres);
    scene.place({{{0.02, rest, 0.02}, {0, amplitude * rate, 0}, {}}});
    const double leaves = strength > 1 ? std::asin(1 / strength) / rate : 1;
    double largest = 0;
    for (int n = 0; n < 200; ++n) {
      const double time = n * 50 * dt;
      if (time > 0.6 / frequency) break;
      const double flight = std::max(0.0, time - leaves);
      double exact = rest + amplitude * std::sin(rate * time);
      if (flight > 0) {
        exact = rest + amplitude * (std::sin(rate * leaves) + rate * std::cos(rate * leaves) * flight) -
                0.5 * gravity * flight * flight;
      }
      largest = std::max(largest, std::abs(scene.gathered().at(0).position.y - exact));
      scene.advance(50, dt, time);
    }
    EXPECT_LT(largest, 1e-4 * amplitude) << strength;  // the contact's spring gives way by 3e-6 of it, and throws the ball
  }
}

// A paddle sweeps through scattered balls; each follows the same path to the bit whenever lists are made.
TEST(Paddle, WhatItHitsDoesNotDependOnTheLists) {
  const auto facets = tessellated({0.005, 0.0195, 0.001}, {0.03, 0, 0}, {0, 0, 0.038}, 5, 3);
  std::array<std::map<std::int64_t, Particle>, 2> ends;
  for (const int run : {0, 1}) {
    Spheres spheres = one_ball(0.3, Mesh(facets), Rotation{{0.02, 0.02, 0}, {0, 0, 1}, 40});
    spheres.gravity = {};
    spheres.skin = run == 0 ? 0.6e-3 : 1e-6;
    Scene<TangentialSpring> scene(Comm::self(), box, spheres);
    std::vector<PlacedSphere> balls;
    for (int n = 0; n < 12; ++n) {
      const double turn = 2 * std::numbers::pi * (n + 0.5) / 12;
      balls.push_back({{0.02 + 0.01 * std::cos(turn), 0.02 + 0.01 * std::sin(turn), 0.003 + 0.003 * n}, {}, {}});
    }
    scene.place(balls);
    scene.advance(4000, sub_step(spheres), 0.0);
    ends[run] = scene.gathered();
    int hit = 0;
    for (const auto& [id, ball] : ends[run]) hit += norm(ball.velocity) > 0.1;
    EXPECT_GE(hit, 2);
  }
  for (const auto& [id, ball] : ends[0]) {
    EXPECT_EQ(ball.position, ends[1].at(id).position) << id;
    EXPECT_EQ(ball.spin, ends[1].at(id).spin) << id;
  }
}

TEST(Lost, ABallOnTheWrongSideStopsTheRunByName) {
  const Revolved drum = Revolved::cylinder({0.02, 0.02, -0.01}, {0.02, 0.02, 0.05}, 0.015, true, Keep::inside);
  Spheres spheres = one_ball(0.3, drum, Rotation{{0.02, 0.02, 0}, {0, 0, 1}, 3});
  Scene<TangentialSpring> scene(Comm::self(), box, spheres);
  scene.place({{{0.02, 0.02, 0.02}, {}, {}}, {{0.001, 0.02, 0.02}, {}, {}}});
  scene.advance(1, 1e-6, 0.0);
  EXPECT_EQ(scene.dem.failure().reason, Reason::particle_lost);
  EXPECT_NE(scene.dem.failure().message.find("particle 1 is on the wrong side of the wall wall"), std::string::npos);

  scene.place({{{0.02, 0.006, 0.02}, {0, -400, 0}, {}}});  // shot through the wall
  for (int n = 0; n < 20 && !scene.dem.failure(); ++n) scene.advance(1, 5e-7, 0.0);
  EXPECT_EQ(scene.dem.failure().reason, Reason::particle_lost);
}

}  // namespace
}  // namespace bedflow
