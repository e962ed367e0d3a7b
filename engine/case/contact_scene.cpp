#include "case/contact_scene.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace bedflow {

namespace {

// What the laws of one pair are made from.
struct Parameters {
  double restitution = 1, friction = 0, rolling_friction = 0, stiffness = 0, hamaker = 0;
  double modulus = 0, shear_modulus = 0;  // E*, G*
};

double either(bool given, double value, double otherwise) {
  return given ? value : otherwise;
}

// 1/E* = (1 − ν1²)/E1 + (1 − ν2²)/E2,  1/G* = (2 − ν1)/G1 + (2 − ν2)/G2,  G = E/(2(1 + ν)).
void set_moduli(Parameters& to, double e1, double nu1, double e2, double nu2) {
  to.modulus = 1 / ((1 - nu1 * nu1) / e1 + (1 - nu2 * nu2) / e2);
  to.shear_modulus = 1 / (2 * (1 + nu1) * (2 - nu1) / e1 + 2 * (1 + nu2) * (2 - nu2) / e2);
}

// Of all particles among themselves, or on walls.
Parameters common(const v1::Particles& from, bool wall) {
  Parameters to;
  if (from.has_linear_spring_dashpot()) {
    const v1::LinearSpringDashpot& law = from.linear_spring_dashpot();
    to.stiffness = either(wall && law.has_wall_stiffness(), law.wall_stiffness(), law.stiffness());
    to.restitution = either(wall && law.has_wall_restitution(), law.wall_restitution(), law.restitution());
  } else {
    const v1::Hertz& law = from.hertz();
    to.restitution = either(wall && law.has_wall_restitution(), law.wall_restitution(), law.restitution());
    set_moduli(to, law.youngs_modulus(), law.poisson_ratio(),
               either(wall && law.has_wall_youngs_modulus(), law.wall_youngs_modulus(), law.youngs_modulus()),
               either(wall && law.has_wall_poisson_ratio(), law.wall_poisson_ratio(), law.poisson_ratio()));
  }
  const auto friction = [&](const auto& law) {
    return either(wall && law.has_wall_friction(), law.wall_friction(), law.friction());
  };
  if (from.has_coulomb()) to.friction = friction(from.coulomb());
  if (from.has_spring()) to.friction = friction(from.spring());
  if (from.has_mindlin()) to.friction = friction(from.mindlin());
  if (from.has_constant_rolling()) to.rolling_friction = friction(from.constant_rolling());
  if (from.has_spring_rolling()) to.rolling_friction = friction(from.spring_rolling());
  const v1::VanDerWaals& attraction = from.van_der_waals();
  to.hamaker = either(wall && attraction.has_wall_hamaker(), attraction.wall_hamaker(), attraction.hamaker());
  return to;
}

void refine(Parameters& to, const v1::PairContact& pair) {
  if (pair.has_restitution()) to.restitution = pair.restitution();
  if (pair.has_friction()) to.friction = pair.friction();
  if (pair.has_rolling_friction()) to.rolling_friction = pair.rolling_friction();
  if (pair.has_stiffness()) to.stiffness = pair.stiffness();
  if (pair.has_modulus()) to.modulus = pair.modulus();
  if (pair.has_shear_modulus()) to.shear_modulus = pair.shear_modulus();
  if (pair.has_hamaker()) to.hamaker = pair.hamaker();
}

void refine(Parameters& to, const v1::Particles& from, const std::string& first, const std::string& second) {
  for (const v1::PairContact& pair : from.pairs())
    if ((pair.first() == first && pair.second() == second) || (pair.first() == second && pair.second() == first))
      refine(to, pair);
}

// Of a pair of types, or of a type and the faces of the box.
Parameters parameters(const v1::Particles& from, const std::string& first, const std::string& second) {
  Parameters to = common(from, second == "wall");
  refine(to, from, first, second);
  return to;
}

// Of a type and a wall of the scene: as on the faces of the box but for what the wall says, and what the pair of the two says.
Parameters parameters(const v1::Particles& from, const std::string& type, const v1::Wall& wall) {
  Parameters to = parameters(from, type, "wall");
  if (wall.has_restitution()) to.restitution = wall.restitution();
  if (wall.has_friction()) to.friction = wall.friction();
  refine(to, from, type, wall.name());
  return to;
}

// make(parameters) for each pair of types, each type on the faces of the box, and each wall, then each panel, and type.
template <class Make>
auto table(const v1::Case& from, const std::vector<ContactType>& types, Make make) {
  LawTable<decltype(make(Parameters{}))> result;
  for (std::size_t b = 0; b < types.size(); ++b) {
    for (std::size_t a = 0; a <= b; ++a) result.pairs.push_back(make(parameters(from.particles(), types[a].name, types[b].name)));
    result.walls.push_back(make(parameters(from.particles(), types[b].name, "wall")));
  }
  for (const v1::Wall& wall : from.walls())
    for (const ContactType& type : types) result.walls.push_back(make(parameters(from.particles(), type.name, wall)));
  for (int i = 0; i < from.domain().panels_size(); ++i)
    for (const ContactType& type : types) result.walls.push_back(make(parameters(from.particles(), type.name, "wall")));
  return result;
}

ContactLaw contact_law(const v1::Case& scene, const std::vector<ContactType>& types, std::optional<double> restitution) {
  const v1::Particles& from = scene.particles();
  if (from.has_hertz())
    return table(scene, types,
                 [&](const Parameters& p) { return Hertz::from_restitution(p.modulus, restitution.value_or(p.restitution)); });
  return table(scene, types, [&](const Parameters& p) {
    return LinearSpringDashpot::from_restitution(p.stiffness, restitution.value_or(p.restitution));
  });
}

TangentialLaw tangential_law(const v1::Case& scene, const std::vector<ContactType>& types) {
  const v1::Particles& from = scene.particles();
  if (from.has_coulomb()) return table(scene, types, [](const Parameters& p) { return Coulomb{p.friction}; });
  if (from.has_spring())
    return table(scene, types, [&](const Parameters& p) {
      return TangentialSpring::from_normal(p.friction, LinearSpringDashpot::from_restitution(p.stiffness, p.restitution),
                                           from.spring().stiffness_ratio(), from.spring().damping_ratio());
    });
  if (from.has_mindlin())
    return table(scene, types, [](const Parameters& p) {
      return Mindlin{p.friction, p.shear_modulus, damping_share(p.restitution)};
    });
  return table(scene, types, [](const Parameters&) { return Frictionless{}; });
}

// The rolling spring scales with the linear law's k; with Hertz, with its slope at 1 % overlap of the first type's particles.
RollingLaw rolling_law(const v1::Case& scene, const std::vector<ContactType>& types) {
  const v1::Particles& from = scene.particles();
  if (from.has_constant_rolling())
    return table(scene, types, [](const Parameters& p) { return ConstantRolling{p.rolling_friction}; });
  if (from.has_spring_rolling())
    return table(scene, types, [&](const Parameters& p) {
      const double radius = types.front().type.radius;
      const double stiffness = from.has_hertz() ? 2 * p.modulus * radius * std::sqrt(0.01) : p.stiffness;
      return SpringRolling{p.rolling_friction, stiffness, from.spring_rolling().damping_share()};
    });
  return LawTable<FreeRolling>{};
}

CohesionLaw cohesion_law(const v1::Case& scene, const std::vector<ContactType>& types) {
  const v1::Particles& from = scene.particles();
  if (!from.has_van_der_waals()) return LawTable<NoCohesion>{};
  const v1::VanDerWaals& law = from.van_der_waals();
  const double furthest = law.has_furthest() ? law.furthest() : 0.5 * types.front().type.radius;
  return table(scene, types, [&](const Parameters& p) { return VanDerWaals{p.hamaker, law.nearest(), furthest}; });
}

}  // namespace

ContactLaws contact_laws(const v1::Case& from, const std::vector<ContactType>& types) {
  return {contact_law(from, types, {}), tangential_law(from, types), rolling_law(from, types), cohesion_law(from, types)};
}

ContactLaw contact_law_with(const v1::Case& from, const std::vector<ContactType>& types, double restitution) {
  return contact_law(from, types, restitution);
}

double collision_time(const v1::Case& from, const ContactLaw& law, const std::vector<ContactType>& types) {
  const auto time = [&]<class Law>(const Law& of, double mass, double radius) {
    if constexpr (std::is_same_v<Law, Hertz>) {
      return of.collision_time(mass, radius, from.particles().hertz().impact_speed());
    } else {
      return of.collision_time(mass);
    }
  };
  double shortest = std::numeric_limits<double>::infinity();
  std::visit(
      [&](const auto& laws) {
        for (std::size_t b = 0; b < types.size(); ++b) {
          const double radius_b = types[b].smallest_radius, mass_b = types[b].type.mass_of(radius_b);
          for (std::size_t w = b; w < laws.walls.size(); w += types.size())
            shortest = std::min(shortest, time(laws.walls[w], mass_b, radius_b));
          for (std::size_t a = 0; a <= b; ++a) {
            const double radius_a = types[a].smallest_radius, mass_a = types[a].type.mass_of(radius_a);
            shortest = std::min(shortest, time(laws.pairs[pair_index(a, b)], mass_a * mass_b / (mass_a + mass_b),
                                               radius_a * radius_b / (radius_a + radius_b)));
          }
        }
      },
      law);
  return shortest;
}

}  // namespace bedflow
