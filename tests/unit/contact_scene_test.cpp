// Parameters of contacts from a case: who meets whom.
#include "case/contact_scene.h"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

namespace bedflow {
namespace {

constexpr const char* two_types_two_walls = R"(
  particles {
    types { name: "glass" density: 2500 constant { diameter: 0.002 } }
    types { name: "steel" density: 7800 constant { diameter: 0.001 } }
    linear_spring_dashpot { stiffness: 1000 restitution: 0.9 wall_restitution: 0.8 }
    coulomb { friction: 0.3 wall_friction: 0.2 }
    pairs { first: "steel" second: "glass" friction: 0.25 }
    pairs { first: "steel" second: "wall" friction: 0.15 }
    pairs { first: "glass" second: "paddle" friction: 0.05 }
  }
  walls { name: "paddle" friction: 0.4 restitution: 0.7 }
  walls { name: "sieve" })";

// Coefficients of friction.
struct Frictions {
  std::vector<double> pairs, walls;
};
Frictions frictions_of(const std::string& text) {
  v1::Case from;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &from));
  std::vector<ContactType> types;
  for (const v1::ParticleType& type : from.particles().types()) {
    const double radius = type.constant().diameter() / 2;
    types.push_back({type.name(), {radius, type.density(), false}, radius});
  }
  const ContactLaws laws = contact_laws(from, types);
  const auto& table = std::get<LawTable<Coulomb>>(laws.tangential);
  Frictions result;
  for (const Coulomb& law : table.pairs) result.pairs.push_back(law.friction);
  for (const Coulomb& law : table.walls) result.walls.push_back(law.friction);
  return result;
}

TEST(ContactScene, APairSaysMoreThanAWallAndAWallMoreThanTheLaw) {
  const Frictions found = frictions_of(two_types_two_walls);
  EXPECT_EQ(found.pairs, (std::vector<double>{0.3, 0.25, 0.3}));        // glass, glass and steel, steel
  EXPECT_EQ(found.walls, (std::vector<double>{0.2, 0.15,                // the faces: of glass, of steel
                                              0.05, 0.4, 0.2, 0.15}));  // the paddle, the sieve
}

}  // namespace
}  // namespace bedflow
