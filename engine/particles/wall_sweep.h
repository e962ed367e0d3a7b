// Forces and torques of the contacts between particles and walls in a sub-step: as between particles, with m* = m, R* = r, ℓ =
// the distance to the wall, n from the particle to the wall, and the velocity relative to the wall's material.
#pragma once

#include "particles/laws.h"
#include "particles/pair_sweep.h"

namespace bedflow {

struct WallResult {
  double deepest = 0;   // largest overlap over the diameter
  bool passed = false;  // a centre is beyond a wall

  void note(const WallResult& other) {
    deepest = max(deepest, other.deepest);
    passed |= other.passed;
  }
};

// What the particles do to a wall.
struct WallLoad {
  Vec3 force;   // N
  Vec3 torque;  // about the wall's point of reference, N m
};

struct WallContact {
  std::uint32_t particle;
  std::size_t law;  // of LawTable::walls
  Vec3 n;           // from the particle to the wall
  double distance, radius;
  Vec3 velocity;   // of the particle, less the wall's at the contact
  Vec3 wall_spin;  // rad/s
  Touching<double> touching;
  Vec3 arm;                         // from the wall's point of reference to the contact
  Vec3 *wall_force, *wall_torque;   // that the wall has received; no torque on a face of the box
  MemoryRow *displacement, *angle;  // where the laws have a memory
  Vec3 wall_velocity{};             // at the contact, m/s
  double* power = nullptr;          // that the walls which move have put into the particles, W

  void push(const Bodies& bodies, Vec3 force, Vec3 torque) const {
    bodies.force[particle].add(force, torque);
    *wall_force -= force;
    if (wall_torque) *wall_torque -= cross(arm, force);
    if (power) *power += dot(force, wall_velocity);
  }
};

// Calls take(contact) for every face of the box that a particle is nearer to than its radius plus `range`. Every face counts
// once, also two or three at an edge or a corner.
template <class Take>
WallResult each_face_contact(PairList& list, const std::array<Plane, 6>& faces, const DemSetup& setup,
                             const ParticleStore& particles, std::vector<WallLoad>& loads, double range, Take take) {
  const auto row = [](std::vector<MemoryRow>& rows, std::size_t w) { return rows.empty() ? nullptr : &rows[w]; };
  WallResult result;
  for (std::size_t w = 0; w < list.near.size(); ++w) {
    const auto [i, face] = list.near[w];
    const Vec3 v = particles.velocity(i);
    const double distance = faces[face].distance(particles.position(i)), radius = radius_of(setup.types, particles, i);
    result.passed |= !(distance >= 0);
    if (!(distance < radius + range) || setup.sides[face / 2][face % 2] == Side::open) continue;
    const std::size_t type = particles.type.empty() ? 0 : particles.type[i];
    const Vec3 n = -faces[face].normal;
    const double overlap = radius - distance;
    result.deepest = max(result.deepest, overlap / (2 * radius));
    take(WallContact{i,
                     type,
                     n,
                     distance,
                     radius,
                     v,
                     {},
                     {overlap, dot(v, n), setup.types[type].mass_of(radius), radius},
                     {},
                     &loads[face].force,
                     nullptr,
                     row(list.wall_memory.displacement, w),
                     row(list.wall_memory.angle, w)});
  }
  return result;
}

// What the law says of a contact, from its memory row where it has a memory: emptied when it did not touch in the sub-step
// before.
template <class Law, class Contact>
Vec3 with_memory(const Law& law, const Contact& contact, MemoryRow* row, double now) {
  if constexpr (!Law::history) {
    return law(contact);
  } else {
    if (row->touched != now - 1) row->value = {};
    row->touched = now;
    return law(contact, row->value);
  }
}

// Each of the sweeps runs over each(range, take), which calls take(contact) as each_face_contact does.
template <class Each, class Contact, class Tangential>
WallResult sweep_walls(const Each& each, const ParticleStore& particles, const Bodies& bodies,
                       const std::vector<Contact>& contact, const std::vector<Tangential>& tangential) {
  return each(0, [&](const WallContact& c) {
    const double normal = contact[c.law](c.touching);
    Vec3 force = -normal * c.n, torque;
    if constexpr (Tangential::rotation) {
      const Vec3 slip = c.velocity - c.touching.approach * c.n + cross(c.distance * particles.spin(c.particle), c.n);
      const Sliding<double> sliding{c.n, slip, abs(normal), 2.0 / 7 * c.touching.mass, bodies.dt, c.touching};
      const Vec3 friction = with_memory(tangential[c.law], sliding, c.displacement, bodies.now);
      force += friction;
      torque = c.distance * cross(c.n, friction);
    }
    c.push(bodies, force, torque);
  });
}

template <class Each, class Contact, class Rolling>
void sweep_walls_rolling(const Each& each, const ParticleStore& particles, const Bodies& bodies,
                         const std::vector<Contact>& contact, const std::vector<Rolling>& rolling) {
  each(0, [&](const WallContact& c) {
    const Vec3 spin = particles.spin(c.particle) - c.wall_spin;
    const RollingContact<double> rolls{
        c.n,       spin - dot(spin, c.n) * c.n, abs(contact[c.law](c.touching)), inertia_of(c.touching.mass, c.radius), bodies.dt,
        c.touching};
    const Vec3 torque = with_memory(rolling[c.law], rolls, c.angle, bodies.now);
    c.push(bodies, {}, torque);
    if (c.wall_torque) *c.wall_torque -= torque;
    if (c.power) *c.power += dot(torque, c.wall_spin);
  });
}

template <class Each, class Cohesion>
void sweep_walls_cohesion(const Each& each, double range, const Bodies& bodies, const std::vector<Cohesion>& cohesion) {
  each(range, [&](const WallContact& c) { c.push(bodies, cohesion[c.law](-c.touching.overlap, c.radius) * c.n, {}); });
}

}  // namespace bedflow
