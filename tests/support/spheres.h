// Equal spheres for tests and sweeps: what they are made of, and the laws of their contacts.
#pragma once

#include <array>
#include <vector>

#include "particles/dem.h"

namespace bedflow {

// Müller's spheres in a box without gravity.
struct Spheres {
  double diameter = 1.2e-3, density = 1000, stiffness = 440, restitution = 0.97, friction = 0.1;
  Vec3 gravity{};
  double skin = 0.3e-3;
  std::array<Side, 3> sides{Side::wall, Side::wall, Side::wall};
  std::vector<Wall> walls{};

  ParticleType type() const { return {diameter / 2, density, false}; }
  double mass() const { return type().mass(); }
  LinearSpringDashpot contact() const { return LinearSpringDashpot::from_restitution(stiffness, restitution); }
  double collision_time() const { return contact().collision_time(mass() / 2); }
  template <class Law>
  Law law() const {
    if constexpr (std::is_same_v<Law, Coulomb>) return {friction};
    if constexpr (std::is_same_v<Law, TangentialSpring>) return TangentialSpring::from_normal(friction, contact());
    if constexpr (std::is_same_v<Law, Frictionless>) return {};
  }
  // The same between particles and on walls.
  template <class Law>
  LawTable<Law> everywhere(const Law& law) const {
    return {{law}, std::vector<Law>(1 + walls.size(), law)};
  }
  template <class Law>
  ContactLaws laws() const {
    ContactLaws result;
    result.contact = everywhere(contact());
    result.tangential = everywhere(law<Law>());
    return result;
  }
};

}  // namespace bedflow
