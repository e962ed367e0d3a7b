// Forces and torques of the contacts between particles and the faces of the box in a sub-step: as between particles, with m* = m,
// R* = r, ℓ = the distance to the wall, and n from the particle to the wall. Every face counts once, also two or three at an edge
// or a corner.
#pragma once

#include "particles/laws.h"
#include "particles/pair_sweep.h"

namespace bedflow {

struct WallResult {
  double deepest = 0;   // largest overlap over the diameter
  bool passed = false;  // a centre is beyond a face of the box
};

struct WallContact {
  std::uint32_t particle;
  std::size_t near, type;  // place in the list of near faces; of the particle
  Vec3 n;                  // from the particle to the wall
  double distance, radius;
  Touching<double> touching;
};

// Calls take(contact) for every wall of the box that a particle is nearer to than its radius plus `range`.
template <class Take>
WallResult each_wall_contact(const PairList& list, const std::array<Plane, 6>& faces, const DemSetup& setup,
                             const ParticleStore& particles, double range, Take take) {
  WallResult result;
  for (std::size_t w = 0; w < list.near.size(); ++w) {
    const auto [i, face] = list.near[w];
    const double distance = faces[face].distance(particles.position(i)), radius = radius_of(setup, particles, i);
    result.passed |= !(distance >= 0);
    if (!(distance < radius + range) || setup.sides[face / 2][face % 2] == Side::open) continue;
    const std::size_t type = particles.type.empty() ? 0 : particles.type[i];
    const Vec3 n = -faces[face].normal;
    const double overlap = radius - distance;
    result.deepest = max(result.deepest, overlap / (2 * radius));
    take(WallContact{
        i, w, type, n, distance, radius, {overlap, dot(particles.velocity(i), n), setup.types[type].mass_of(radius), radius}});
  }
  return result;
}

// A contact's memory row, emptied when it did not touch in the sub-step before.
inline Vec3& recalled(MemoryRow& row, double now) {
  if (row.touched != now - 1) row.value = {};
  row.touched = now;
  return row.value;
}

template <class Contact, class Tangential>
WallResult sweep_walls(PairList& list, const std::array<Plane, 6>& faces, const DemSetup& setup, const ParticleStore& particles,
                       const Bodies& bodies, const std::vector<Contact>& contact, const std::vector<Tangential>& tangential) {
  return each_wall_contact(list, faces, setup, particles, 0, [&](const WallContact& c) {
    const double normal = contact[c.type](c.touching);
    Vec3 force = -normal * c.n, torque;
    if constexpr (Tangential::rotation) {
      const Vec3 slip =
          particles.velocity(c.particle) - c.touching.approach * c.n + cross(c.distance * particles.spin(c.particle), c.n);
      const Sliding<double> sliding{c.n, slip, abs(normal), 2.0 / 7 * c.touching.mass, bodies.dt, c.touching};
      Vec3 friction;
      if constexpr (Tangential::history) {
        friction = tangential[c.type](sliding, recalled(list.wall_memory.displacement[c.near], bodies.now));
      } else {
        friction = tangential[c.type](sliding);
      }
      force += friction;
      torque = c.distance * cross(c.n, friction);
    }
    bodies.force[c.particle].add(force, torque);
  });
}

template <class Contact, class Rolling>
void sweep_walls_rolling(PairList& list, const std::array<Plane, 6>& faces, const DemSetup& setup, const ParticleStore& particles,
                         const Bodies& bodies, const std::vector<Contact>& contact, const std::vector<Rolling>& rolling) {
  each_wall_contact(list, faces, setup, particles, 0, [&](const WallContact& c) {
    const Vec3 spin = particles.spin(c.particle);
    const RollingContact<double> rolls{c.n,
                                       spin - dot(spin, c.n) * c.n,
                                       abs(contact[c.type](c.touching)),
                                       inertia_of(c.touching.mass, c.radius),
                                       bodies.dt,
                                       c.touching};
    Vec3 torque;
    if constexpr (Rolling::history) {
      torque = rolling[c.type](rolls, recalled(list.wall_memory.angle[c.near], bodies.now));
    } else {
      torque = rolling[c.type](rolls);
    }
    bodies.force[c.particle].add({}, torque);
  });
}

template <class Cohesion>
void sweep_walls_cohesion(const PairList& list, const std::array<Plane, 6>& faces, const DemSetup& setup,
                          const ParticleStore& particles, const Bodies& bodies, const std::vector<Cohesion>& cohesion) {
  each_wall_contact(list, faces, setup, particles, setup.range, [&](const WallContact& c) {
    bodies.force[c.particle].add(cohesion[c.type](-c.touching.overlap, c.radius) * c.n, {});
  });
}

}  // namespace bedflow
