// The contact laws of a scene, each with its parameters for every pair of types and every type on a wall.
#pragma once

#include <variant>
#include <vector>

#include "models/cohesion.h"
#include "models/contact.h"
#include "models/rolling.h"
#include "models/tangential.h"

namespace bedflow {

// Parameters of a law for each pair of types and for each type on a wall.
template <class Law>
struct LawTable {
  std::vector<Law> pairs;  // by pair_index
  std::vector<Law> walls;  // by type on the faces of the box, then by wall of the scene and type
};
// Place of the types a ≤ b in the upper triangle.
constexpr std::size_t pair_index(std::size_t a, std::size_t b) {
  return b * (b + 1) / 2 + a;
}

using ContactLaw = std::variant<LawTable<LinearSpringDashpot>, LawTable<Hertz>>;
using TangentialLaw = std::variant<LawTable<Frictionless>, LawTable<Coulomb>, LawTable<TangentialSpring>, LawTable<Mindlin>>;
using RollingLaw = std::variant<LawTable<FreeRolling>, LawTable<ConstantRolling>, LawTable<SpringRolling>>;
using CohesionLaw = std::variant<LawTable<NoCohesion>, LawTable<VanDerWaals>>;

// Mindlin's stiffness is that of Hertz's contact, the tangential spring a share of the linear one: no other pairs are built.
template <class Contact, class Tangential>
inline constexpr bool fit_together = !(std::is_same_v<Contact, LinearSpringDashpot> && std::is_same_v<Tangential, Mindlin>)&&!(
    std::is_same_v<Contact, Hertz> && std::is_same_v<Tangential, TangentialSpring>);

struct ContactLaws {
  ContactLaw contact;
  TangentialLaw tangential;
  RollingLaw rolling;
  CohesionLaw cohesion;

  bool rotation() const {
    return std::visit([]<class Law>(const LawTable<Law>&) { return Law::rotation; }, tangential) || rolls();
  }
  bool history() const {
    return std::visit([]<class Law>(const LawTable<Law>&) { return Law::history; }, tangential);
  }
  bool rolls() const { return !std::holds_alternative<LawTable<FreeRolling>>(rolling); }
  bool rolling_history() const {
    return std::visit([]<class Law>(const LawTable<Law>&) { return Law::history; }, rolling);
  }
  double range() const {  // gap over which particles attract each other, m
    double furthest = 0;
    if (const auto* laws = std::get_if<LawTable<VanDerWaals>>(&cohesion))
      for (const auto* table : {&laws->pairs, &laws->walls})
        for (const VanDerWaals& law : *table) furthest = max(furthest, law.furthest);
    return furthest;
  }
};

}  // namespace bedflow
