// The rules about types, sizes, seeding regions, and particles that enter and leave.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "case_file.h"
#include "support/case_faults.h"

namespace bedflow {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

// A box of particles alone, from what is said of types, seeding and faces.
std::string box(const std::string& particles, const std::string& faces = "") {
  return R"(name: "box" domain { size { x: 0.1 y: 0.2 z: 0.1 } faces { )" + faces + R"( } } gravity { y: -9.81 } time { end: 1 }
    particles { linear_spring_dashpot { stiffness: 1000 restitution: 0.9 } frictionless {} symplectic_euler {} )" +
         particles + "}";
}
std::vector<CaseFault> faults(const std::string& particles, const std::string& faces = "") {
  return read_case(box(particles, faces)).faults;
}

const std::string sand =
    R"(types { name: "sand" density: 2600 log_normal { median: 0.001 deviation: 0.3 smallest: 0.0005 largest: 0.002 } } )";
const std::string mix = sand + R"(types { name: "pellets" density: 900 constant { diameter: 0.004 } share: 0.2 } )";
const std::string hundred = "random { count: 100 seed: 1 } ";

TEST(TypeRules, GoodTypesAreSilent) {
  EXPECT_THAT(faults("diameter: 0.001 density: 1000 " + hundred), IsEmpty());
  EXPECT_THAT(faults(mix + hundred), IsEmpty());
  EXPECT_THAT(faults(mix + "shares_by: MASS random { solids_fraction: 0.2 seed: 1 }"), IsEmpty());
}

TEST(TypeRules, KindsAreToldInOneOfTwoWays) {
  EXPECT_THAT(faults(hundred),
              ElementsAre(fault_at("particles.diameter", "or particles.types"), fault_at("particles.density", "kg/m³")));
  EXPECT_THAT(faults("diameter: 0.001 " + sand + hundred), ElementsAre(fault_at("particles.diameter", "remove one of the two")));
  EXPECT_THAT(faults("density: 900 " + sand + hundred), ElementsAre(fault_at("particles.density", "remove one of the two")));
}

TEST(TypeRules, TypesHaveNamesOfTheirOwnAndAShare) {
  EXPECT_THAT(faults(sand + sand + hundred), ElementsAre(fault_at("particles.types[1].name", "\"sand\"")));
  EXPECT_THAT(faults(R"(types { name: "a" density: 1 constant { diameter: 0.001 } share: 0 } )" + hundred),
              ElementsAre(fault_at("particles.types", "all 0")));
}

TEST(TypeRules, LawsOfSizesAreInOrder) {
  const auto type = [](const std::string& law) { return "types { name: \"a\" density: 1000 " + law + " } " + hundred; };
  EXPECT_THAT(faults(type("uniform { smallest: 0.002 largest: 0.002 }")),
              ElementsAre(fault_at("particles.types[0].uniform.largest", "for one size set constant")));
  EXPECT_THAT(faults(type("normal { mean: 0.003 deviation: 0.001 smallest: 0.001 largest: 0.002 }")),
              ElementsAre(fault_at("particles.types[0].normal.mean", "between smallest, 0.001 m, and largest, 0.002 m")));
  EXPECT_THAT(faults(type("log_normal { median: 0.0005 deviation: 0.1 smallest: 0.001 largest: 0.002 }")),
              ElementsAre(fault_at("particles.types[0].log_normal.median", "is 5e-04 m")));
  EXPECT_THAT(faults(type("discrete { classes { diameter: 0.001 share: 0 } }")),
              ElementsAre(fault_at("particles.types[0].discrete.classes", "all 0")));
  EXPECT_THAT(
      faults(type("histogram { smallest: 0.001 classes { diameter: 0.003 share: 1 } classes { diameter: 0.002 share: 1 } }")),
      Contains(fault_at("particles.types[0].histogram.classes[1].diameter", "must be above 0.003 m")));
  EXPECT_THAT(faults(type("histogram { smallest: 0.001 classes { diameter: 0.001 share: 1 } }")),
              ElementsAre(fault_at("particles.types[0].histogram.classes[0].diameter", "histogram.smallest")));
  EXPECT_THAT(faults(type("constant { diameter: 0.15 }")), Contains(fault_at("particles.types[0]", "domain.size.x, 0.1 m")));
}

TEST(SeedingRules, ARandomRegionHasACountOrASolidsFraction) {
  EXPECT_THAT(faults(sand + "random { seed: 1 }"), ElementsAre(fault_at("particles.random.count", "or solids_fraction")));
  EXPECT_THAT(faults(sand + "random { seed: 1 count: 5 solids_fraction: 0.1 }"),
              ElementsAre(fault_at("particles.random.solids_fraction", "remove one of the two")));
  EXPECT_THAT(faults(sand + "random { seed: 1 solids_fraction: 0.4 }"),
              ElementsAre(fault_at("particles.random.solids_fraction", "at most 0.35")));
}

// 2 l at 0.35 hold 700 cm³: 20 889 pellets of 4 mm.
TEST(SeedingRules, TooManyParticlesAreCountedByTheirOwnVolume) {
  const std::string pellets = R"(types { name: "pellets" density: 900 constant { diameter: 0.004 } } )";
  EXPECT_THAT(faults(pellets + "random { count: 20889 seed: 1 }"), IsEmpty());
  EXPECT_THAT(faults(pellets + "random { count: 20900 seed: 1 }"),
              ElementsAre(fault_at("particles.random.count", "20889 particles")));
}

TEST(SeedingRules, RegionsOfAComposedBedAreCheckedEachAtItsPath) {
  EXPECT_THAT(faults(mix + R"(composed { settling { duration: 1 }
      regions { random { count: 10 seed: 1 region { low {} high { x: 0.1 y: 0.1 z: 0.1 } } } types { type: "sand" } }
      regions { lattice { count { x: 5 y: 5 z: 5 } region { low { y: 0.1 } high { x: 0.1 y: 0.2 z: 0.1 } } } } })"),
              IsEmpty());
  EXPECT_THAT(faults(mix + R"(composed {
      regions { random { count: 10 seed: 1 settling { duration: 1 } region { low {} high { x: 0.1 y: 0.3 z: 0.1 } } } }
      regions { lattice { count { x: 40 y: 5 z: 5 } } types { type: "stones" } types { type: "sand" } types { type: "sand" } }
      regions { placed { spheres { position { x: 0.05 y: 0.05 z: 0.05 } type: "gravel" } } types { type: "sand" } }
      regions { } })"),
              testing::UnorderedElementsAre(
                  fault_at("particles.composed.regions[0].random.region.high.y", "outside the domain"),
                  fault_at("particles.composed.regions[0].random.settling", "particles.composed.settling"),
                  fault_at("particles.composed.regions[1].types[0].type", "the types in particles.types are sand, pellets"),
                  fault_at("particles.composed.regions[1].types[2].type", "again"),
                  fault_at("particles.composed.regions[2].placed.spheres[0].type", "\"gravel\""),
                  fault_at("particles.composed.regions[2].types", "names its own type"),
                  fault_at("particles.composed.regions[3].places", "is missing")));
}

TEST(SeedingRules, TheLargestOfTheRegionsTypesMustFitTheLattice) {
  const std::string lattice = "composed { regions { lattice { count { x: 40 y: 5 z: 5 } } ";
  EXPECT_THAT(faults(mix + lattice + "types { type: \"sand\" } } }"), IsEmpty());
  EXPECT_THAT(faults(mix + lattice + "} }"),
              ElementsAre(fault_at("particles.composed.regions[0].lattice.count.x", "the largest diameter, 0.004 m")));
}

TEST(SeedingRules, ASphereHasADiameterOfItsType) {
  const auto sphere = [](const std::string& more) {
    return "placed { spheres { position { x: 0.05 y: 0.05 z: 0.05 } " + more + " } }";
  };
  EXPECT_THAT(faults(mix + sphere("diameter: 0.0015")), IsEmpty());
  EXPECT_THAT(faults(mix + sphere("type: \"pellets\"")), IsEmpty());
  const std::string path = "particles.placed.spheres[0].diameter";
  EXPECT_THAT(faults(mix + sphere("diameter: 0.003")), ElementsAre(fault_at(path, "sand has 5e-04 to 0.002 m")));
  EXPECT_THAT(faults(mix + sphere("type: \"pellets\" diameter: 0.003")), ElementsAre(fault_at(path, "pellets has 0.004 m")));
  EXPECT_THAT(faults("diameter: 0.002 density: 1000 " + sphere("diameter: 0.003")),
              ElementsAre(fault_at(path, "particles.diameter is 0.002 m")));
}

TEST(SeedingRules, AnEmptyBoxNeedsAnInflow) {
  const std::string inflow = "y_high { no_slip_wall {} particle_inflows { number_rate: 10 velocity { y: -1 } } }";
  EXPECT_THAT(faults(sand + "empty {}", inflow), IsEmpty());
  EXPECT_THAT(faults(sand + "empty {}"), ElementsAre(fault_at("particles.empty", "particle_inflows")));
}

TEST(InflowRules, ParticlesComeInAtOneRateThroughAPatchThatTheyFit) {
  const auto from_top = [](const std::string& inflow) {
    return faults(mix + "empty {}", "y_high { no_slip_wall {} particle_inflows { " + inflow + " } }");
  };
  const std::string path = "domain.faces.y_high.particle_inflows[0]", down = "velocity { y: -1 } ", ten = "number_rate: 10 ";
  EXPECT_THAT(from_top(down + "mass_rate: 0.1 from: 1 until: 2 types { type: \"sand\" }"), IsEmpty());
  EXPECT_THAT(from_top(down), ElementsAre(fault_at(path + ".mass_rate", "set one of the two")));
  EXPECT_THAT(from_top(down + ten + "mass_rate: 1"), ElementsAre(fault_at(path + ".mass_rate", "remove one of the two")));
  EXPECT_THAT(from_top(ten + "velocity { x: 1 }"), ElementsAre(fault_at(path + ".velocity.y", "below 0")));
  EXPECT_THAT(from_top(down + ten + "from: 2 until: 1"), ElementsAre(fault_at(path + ".until", "after from, 2 s")));
  EXPECT_THAT(from_top(down + ten + "types { type: \"stones\" }"), ElementsAre(fault_at(path + ".types[0].type", "stones")));
  const std::string narrow = "patch { low { x: 0.05 z: 0.05 } high { x: 0.053 z: 0.06 } } ";
  EXPECT_THAT(from_top(down + ten + narrow), ElementsAre(fault_at(path + ".patch.high.x", "0.004 m must fit through")));
  EXPECT_THAT(from_top(down + ten + narrow + "types { type: \"sand\" }"), IsEmpty());
}

TEST(InflowRules, AScreenLetsNobodyLeave) {
  EXPECT_THAT(faults(sand + hundred, "y_high { outflow { particles: LEAVE } }"), IsEmpty());
  EXPECT_THAT(faults(sand + hundred, "y_high { outflow { particles: LEAVE screen: true } }"),
              ElementsAre(fault_at("domain.faces.y_high.outflow.particles", "screen")));
}

TEST(InflowRules, MonitorsNameTypes) {
  const auto monitor = [](const std::string& type) {
    return read_case(box(mix + hundred) + "monitors { name: \"m\" particle_count { type: \"" + type + "\" } }").faults;
  };
  EXPECT_THAT(monitor("sand"), IsEmpty());
  EXPECT_THAT(monitor("stones"), ElementsAre(fault_at("monitors[0].particle_count.type", "sand, pellets")));
}

// ---------------------------------------------------------------------------------------------------- tables

class SphereTable : public testing::Test {
 protected:
  SphereTable() { std::filesystem::create_directories(folder_); }
  ~SphereTable() override { std::filesystem::remove_all(folder_); }

  CaseRead read(const std::string& table, const std::string& kinds = mix) const {
    std::ofstream(folder_ / "case.txtpb") << box(kinds + "placed { file: \"bed.csv\" }");
    std::ofstream(folder_ / "bed.csv") << table;
    return read_case_file(folder_ / "case.txtpb");
  }
  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / ("bedflow_table_" + std::to_string(getpid()));
};

TEST_F(SphereTable, LinesBecomeSpheresOfACaseThatStandsAlone) {
  const CaseRead read_in =
      read("# a bed\nx, y ,z,vy,type,diameter\n0.01,0.02,0.03,-1,sand,0.001\r\n\n0.05,5e-2,0.05,0,pellets,0.004\n");
  ASSERT_THAT(read_in.faults, IsEmpty());
  const v1::Placed& placed = read_in.value.particles().placed();
  EXPECT_FALSE(placed.has_file());
  ASSERT_EQ(placed.spheres_size(), 2);
  EXPECT_EQ(placed.spheres(0).position().z(), 0.03);
  EXPECT_EQ(placed.spheres(0).velocity().y(), -1);
  EXPECT_EQ(placed.spheres(0).diameter(), 0.001);
  EXPECT_EQ(placed.spheres(1).type(), "pellets");
  EXPECT_EQ(placed.spheres(1).position().y(), 0.05);
}

TEST_F(SphereTable, WhatCannotBeReadIsToldByLine) {
  const auto fault = [](const std::string& text) { return ElementsAre(fault_at("particles.placed.file", text)); };
  EXPECT_THAT(read("x,y,z\n0.01,0.02\n").faults, fault("line 2 has 2 values for 3 columns"));
  EXPECT_THAT(read("x,y,z\n0.01,0.02,wide\n").faults, fault("z is \"wide\": a number is needed"));
  EXPECT_THAT(read("x,y,r\n").faults, fault("names a column \"r\"; there are x, y, z"));
  EXPECT_THAT(read("x,y\n").faults, fault("names no column z"));
  EXPECT_THAT(read("x,y,z,x\n").faults, fault("\"x\" twice"));
  EXPECT_THAT(read("").faults, fault("is empty"));
  EXPECT_THAT(read("x,y,z\n0.01,0.02,0.3\n").faults, ElementsAre(fault_at("particles.placed.spheres[0].position.z", "outside")));
}

TEST_F(SphereTable, ATableThatIsNotThereIsNamedWithItsPath) {
  std::ofstream(folder_ / "case.txtpb") << box(mix + "placed { file: \"none.csv\" }");
  EXPECT_THAT(
      read_case_file(folder_ / "case.txtpb").faults,
      ElementsAre(fault_at("particles.placed.file", (folder_ / "none.csv").string() + "\" cannot be read: No such file")));
}

TEST_F(SphereTable, ACaseWithoutAFolderCannotNameOne) {
  EXPECT_THAT(faults(mix + "placed { file: \"bed.csv\" spheres { position {} } }"),
              ElementsAre(fault_at("particles.placed.file", "beside a case file")));
}

}  // namespace
}  // namespace bedflow
