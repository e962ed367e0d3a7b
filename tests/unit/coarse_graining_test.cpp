// Parcels: what of a case they change, and what cannot be joined into them.
#include "coarse_graining.h"

#include <gmock/gmock.h>

#include <cmath>

#include "case_file.h"
#include "support/case_faults.h"

namespace bedflow {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// A box of particles alone.
std::string box(const std::string& particles, const std::string& faces = "") {
  return R"(name: "box" domain { size { x: 0.1 y: 0.2 z: 0.1 } faces { )" + faces + R"( } } gravity { y: -9.81 } time { end: 1 }
    particles { frictionless {} symplectic_euler {} )" +
         particles + "}";
}
const std::string linear = "linear_spring_dashpot { stiffness: 1000 restitution: 0.9 } ";
const std::string sand = "diameter: 0.001 density: 2600 ";

v1::Case parcels(const std::string& particles, const std::string& faces = "") {
  const auto read = read_case(box(particles, faces));
  EXPECT_THAT(read.faults, IsEmpty());
  return parcels_of(read.value);
}
std::vector<CaseFault> faults(const std::string& particles) {
  return read_case(box(particles)).faults;
}

TEST(CoarseGraining, OfNoneOrOneIsTheCaseItself) {
  const std::string random = linear + sand + "random { count: 1000 seed: 1 } ";
  EXPECT_EQ(case_text(parcels(random)), case_text(read_case(box(random)).value));
  const auto one = parcels(random + "coarse_graining { factor: 1 }").particles();
  EXPECT_EQ(one.diameter(), 0.001);
  EXPECT_EQ(one.random().count(), 1000);
  EXPECT_EQ(one.linear_spring_dashpot().stiffness(), 1000);
  EXPECT_DOUBLE_EQ(one.linear_spring_dashpot().restitution(), 0.9);
}

// l = 2: sizes x 2, numbers / 8, k x 2, 1 − e² = 0.19 x 2 between particles and not on walls.
TEST(CoarseGraining, ScalesSizesNumbersAndContacts) {
  const auto made = parcels(linear + sand + "random { count: 1003 seed: 1 } coarse_graining { factor: 2 }").particles();
  EXPECT_DOUBLE_EQ(made.diameter(), 0.002);
  EXPECT_EQ(made.density(), 2600);
  EXPECT_EQ(made.random().count(), 125);
  const auto& law = made.linear_spring_dashpot();
  EXPECT_DOUBLE_EQ(law.stiffness(), 2000);
  EXPECT_FALSE(law.has_wall_stiffness());
  EXPECT_NEAR(law.restitution(), std::sqrt(1 - 2 * 0.19), 1e-15);
  EXPECT_DOUBLE_EQ(law.wall_restitution(), 0.9);
  const auto kept =
      parcels(linear + sand + "random { count: 10 seed: 1 } coarse_graining { factor: 2 contacts: KEEP_RESTITUTION }")
          .particles();
  EXPECT_EQ(kept.linear_spring_dashpot().restitution(), 0.9);
}

TEST(CoarseGraining, LeavesModuliAndWhatWallsAreGiven) {
  const auto made =
      parcels("hertz { youngs_modulus: 1e7 poisson_ratio: 0.3 restitution: 0.9 impact_speed: 1 wall_restitution: 0.5 } " + sand +
              "random { count: 8 seed: 1 } coarse_graining { factor: 2 } "
              "van_der_waals { hamaker: 1e-19 nearest: 1e-9 furthest: 1e-6 }")
          .particles();
  EXPECT_EQ(made.hertz().youngs_modulus(), 1e7);
  EXPECT_EQ(made.hertz().wall_restitution(), 0.5);
  EXPECT_NEAR(made.hertz().restitution(), std::sqrt(1 - 2 * 0.19), 1e-15);
  // The energy of a bond, A R/(12 s), over the mass: 8 · 2/2 over 8.
  EXPECT_DOUBLE_EQ(made.van_der_waals().hamaker(), 8e-19);
  EXPECT_DOUBLE_EQ(made.van_der_waals().nearest(), 2e-9);
  EXPECT_DOUBLE_EQ(made.van_der_waals().furthest(), 2e-6);
}

TEST(CoarseGraining, ScalesEveryLawOfSizesAndPairsOfTypes) {
  const auto made = parcels(linear + R"(types { name: "a" density: 1 uniform { smallest: 0.001 largest: 0.002 } }
        types { name: "b" density: 1 normal { mean: 0.002 deviation: 0.0005 smallest: 0.001 largest: 0.003 } }
        types { name: "c" density: 1 log_normal { median: 0.002 deviation: 0.3 smallest: 0.001 largest: 0.003 } }
        types { name: "d" density: 1 discrete { classes { diameter: 0.001 share: 3 } } }
        types { name: "e" density: 1 histogram { smallest: 0.001 classes { diameter: 0.002 share: 3 } } }
        pairs { first: "a" second: "b" restitution: 0.8 stiffness: 10 } pairs { first: "a" second: "wall" restitution: 0.8 stiffness: 10 }
        random { solids_fraction: 0.1 seed: 1 } coarse_graining { factor: 1.5 })")
                        .particles();
  EXPECT_DOUBLE_EQ(made.types(0).uniform().largest(), 0.003);
  EXPECT_DOUBLE_EQ(made.types(1).normal().deviation(), 0.00075);
  EXPECT_DOUBLE_EQ(made.types(2).log_normal().median(), 0.003);
  EXPECT_EQ(made.types(2).log_normal().deviation(), 0.3);  // of the logarithm
  EXPECT_DOUBLE_EQ(made.types(3).discrete().classes(0).diameter(), 0.0015);
  EXPECT_EQ(made.types(3).discrete().classes(0).share(), 3);
  EXPECT_DOUBLE_EQ(made.types(4).histogram().smallest(), 0.0015);
  EXPECT_DOUBLE_EQ(made.types(4).histogram().classes(0).diameter(), 0.003);
  EXPECT_NEAR(made.pairs(0).restitution(), std::sqrt(1 - 1.5 * 0.36), 1e-15);
  EXPECT_DOUBLE_EQ(made.pairs(0).stiffness(), 15);
  EXPECT_EQ(made.pairs(1).restitution(), 0.8);
  EXPECT_EQ(made.random().solids_fraction(), 0.1);
}

TEST(CoarseGraining, ScalesRegionsAndWhatEnters) {
  const auto made = parcels(
      linear + sand + R"(composed { regions { random { count: 80 seed: 1 region { low {} high { x: 0.1 y: 0.1 z: 0.1 } } } }
        regions { lattice { count { x: 4 y: 2 z: 6 } region { low { y: 0.1 } high { x: 0.1 y: 0.2 z: 0.1 } } } } } coarse_graining { factor: 2 })",
      "x_low { no_slip_wall {} particle_inflows { number_rate: 80 velocity { x: 1 } } } ");
  EXPECT_EQ(made.particles().composed().regions(0).random().count(), 10);
  const auto& count = made.particles().composed().regions(1).lattice().count();
  EXPECT_THAT((std::array{count.x(), count.y(), count.z()}), ElementsAre(2, 1, 3));
  EXPECT_EQ(made.domain().faces().x_low().particle_inflows(0).number_rate(), 10);
  EXPECT_FALSE(made.domain().faces().has_x_high());
}

TEST(CoarseGraining, RefusesWhatCannotBeJoined) {
  const std::string random = "random { count: 1000 seed: 1 } ";
  EXPECT_THAT(faults(linear + sand + random + "coarse_graining { factor: 6 }"),
              ElementsAre(fault_at("particles.coarse_graining.factor", "below 5.263 only")));
  EXPECT_THAT(faults(linear + sand + random + "coarse_graining { factor: 6 contacts: KEEP_RESTITUTION }"), IsEmpty());
  EXPECT_THAT(faults(linear + sand + random + "coarse_graining { factor: 0.5 }"),
              ElementsAre(fault_at("particles.coarse_graining.factor", "1")));
  EXPECT_THAT(faults(linear + sand + "lattice { count { x: 4 y: 3 z: 4 } } coarse_graining { factor: 2 }"),
              ElementsAre(fault_at("particles.lattice.count.y", "choose a multiple")));
  EXPECT_THAT(faults(linear + sand + "placed { spheres { position { x: 0.05 y: 0.05 z: 0.05 } } } coarse_graining { factor: 2 }"),
              ElementsAre(fault_at("particles.coarse_graining", "each their place")));
}

// What holds for particles holds for parcels, and the fault says so.
TEST(CoarseGraining, RefusesParcelsThatTheRulesRefuse) {
  EXPECT_THAT(
      faults(linear + "diameter: 0.03 density: 1 random { solids_fraction: 0.1 seed: 1 } coarse_graining { factor: 4 }"),
      ElementsAre(fault_at("particles.diameter", "domain.size.x"), fault_at("particles.diameter", "factor = 4 times as wide")));
}

}  // namespace
}  // namespace bedflow
