// Walls of a case: the rules that join their fields, and the STL files that come into a case when it is read.
#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "case_file.h"
#include "cases/ready_cases.h"
#include "support/case_faults.h"

namespace bedflow {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

v1::Case with_wall(const std::string& wall, const std::string& more = "") {
  v1::Case value = ready_case("settling");
  v1::Case added;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString("walls { name: \"w\" " + wall + " } " + more, &added)) << wall;
  value.MergeFrom(added);
  return value;
}
std::vector<CaseFault> faults_of(const std::string& wall, const std::string& more = "") {
  return check_case(with_wall(wall, more));
}

const std::string plane = "plane { point {} normal { y: 1 } } ";
const std::string tube = "cylinder { from {} to { z: 1 } radius: 0.01 } ";

TEST(WallRules, AreSilentOnGoodWalls) {
  for (const std::string& good :
       {plane + "friction: 0.3 restitution: 0.5", tube + "rotating { point {} axis { z: -3 } rate: 2 }",
        std::string("box { low { x: -1 y: -1 z: -1 } high { x: 1 y: 1 z: 1 } particles: INSIDE }"),
        std::string("cylinder { from {} to { z: 1 } radius: 0.01 closed: true particles: INSIDE }"),
        std::string("cone { from {} to { y: 1 } radius_from: 0 radius_to: 0.01 }"),
        std::string("profile { origin {} axis { y: 1 } corners { radius: 0 height: 0 } corners { radius: 1 height: 0 } "
                    "corners { radius: 0 height: 1 } particles: INSIDE }"),
        std::string("mesh { open_sheet: true triangles { a {} b { x: 1 } c { y: 1 } } }"),
        plane + "table { knots { time: 0 displacement {} } knots { time: 1 displacement { y: 1 } } }"})
    EXPECT_THAT(faults_of(good), IsEmpty()) << good;
  EXPECT_THAT(faults_of(plane,
                        "monitors { name: \"f\" wall_force { wall: \"w\" } } monitors { name: \"g\" wall_force { wall: "
                        "\"y_low\" } } monitors { name: \"t\" wall_torque { wall: \"w\" } }"),
              IsEmpty());
}

TEST(WallRules, NamesAreTheirOwn) {
  EXPECT_THAT(faults_of(plane, "walls { name: \"w\" " + plane + "}"), ElementsAre(fault_at("walls[1].name", "as walls[0].name")));
  EXPECT_THAT(faults_of(plane, "walls { name: \"x_low\" " + plane + "}"),
              ElementsAre(fault_at("walls[1].name", "a face of the box")));
}

TEST(WallRules, GasDoesNotSeeThem) {
  v1::Case value = ready_case("mueller");
  value.MergeFrom(with_wall(plane));
  value.clear_walls();
  EXPECT_TRUE(google::protobuf::TextFormat::MergeFromString("walls { name: \"baffle\" " + plane + "}", &value));
  EXPECT_THAT(check_case(value), testing::Contains(fault_at("walls[0]", "\"baffle\", a wall within the gas")));
}

TEST(WallRules, DirectionsAndShapesAreNotDegenerate) {
  EXPECT_THAT(faults_of("plane { point {} normal {} }"), ElementsAre(fault_at("walls[0].plane.normal", "is 0")));
  EXPECT_THAT(faults_of("box { low { x: 1 } high { x: 1 y: 1 z: 1 } }"),
              ElementsAre(fault_at("walls[0].box.high.x", "not above")));
  EXPECT_THAT(faults_of("cylinder { from { x: 1 } to { x: 1 } radius: 1 }"),
              ElementsAre(fault_at("walls[0].cylinder.to", "the same point")));
  EXPECT_THAT(faults_of("cone { from {} to { x: 1 } radius_from: 0 radius_to: 0 }"),
              ElementsAre(fault_at("walls[0].cone.radius_to", "a line")));
  EXPECT_THAT(faults_of("profile { origin {} axis {} corners { radius: 0 height: 0 } corners { radius: 0 height: 1 } corners { "
                        "radius: 1 height: 1 } corners { radius: 1 height: 1 } }"),
              ElementsAre(fault_at("walls[0].profile.axis", "is 0"), fault_at("walls[0].profile.corners[1].radius", "no surface"),
                          fault_at("walls[0].profile.corners[3]", "same point")));
  EXPECT_THAT(faults_of(plane + "rotating { point {} axis {} rate: 1 }"),
              ElementsAre(fault_at("walls[0].rotating.axis", "is 0")));
  EXPECT_THAT(faults_of(plane + "table { knots { time: 1 displacement {} } knots { time: 1 displacement {} } }"),
              ElementsAre(fault_at("walls[0].table.knots[1].time", "not later")));
}

TEST(WallRules, ASideNeedsAClosedWallThatHoldsAParticle) {
  EXPECT_THAT(faults_of("cylinder { from {} to { z: 1 } radius: 1 particles: INSIDE }"),
              ElementsAre(fault_at("walls[0].cylinder.particles", "is INSIDE, but the wall is open")));
  EXPECT_THAT(faults_of("cone { from {} to { z: 1 } radius_from: 1 radius_to: 1 particles: OUTSIDE }"),
              ElementsAre(fault_at("walls[0].cone.particles", "OUTSIDE")));
  EXPECT_THAT(faults_of("cylinder { from {} to { z: 1 } radius: 0.0005 closed: true particles: INSIDE }"),
              ElementsAre(fault_at("walls[0].cylinder.radius", "no particle fits")));
}

TEST(WallRules, FrictionAndCutCellsNeedTheirCounterpart) {
  v1::Case value = with_wall(plane + "friction: 0.2 cut_cells: true");
  value.mutable_particles()->mutable_frictionless();
  EXPECT_THAT(check_case(value), ElementsAre(fault_at("walls[0].friction", "frictionless"),
                                             fault_at("walls[0].cut_cells", "domain.cells is missing")));
}

TEST(WallRules, MonitorsNameAWall) {
  EXPECT_THAT(faults_of(plane, "monitors { name: \"f\" wall_force { wall: \"v\" } }"),
              ElementsAre(testing::Field(&CaseFault::text, HasSubstr("no wall of the case"))));
  EXPECT_THAT(faults_of(plane, "monitors { name: \"t\" wall_torque { wall: \"y_low\" } }"),
              ElementsAre(testing::Field(&CaseFault::text, HasSubstr("wall_force only"))));
}

TEST(WallRules, AMeshIsCheckedForHolesAndItsFileMustHaveBeenRead) {
  EXPECT_THAT(faults_of("mesh { triangles { a {} b { x: 1 } c { y: 1 } } }"),
              ElementsAre(fault_at("walls[0].mesh.open_sheet", "edge (0, 0, 0) – (1, 0, 0) belongs to triangle 1 alone: a hole"),
                          fault_at("walls[0].mesh.open_sheet", "(0, 1, 0)"), fault_at("walls[0].mesh.open_sheet", "(0, 1, 0)")));
  EXPECT_THAT(faults_of("mesh { open_sheet: true triangles { a {} b { x: 1 } c { x: 2 } } }"),
              ElementsAre(fault_at("walls[0].mesh.triangles", "has no area")));
  EXPECT_THAT(faults_of("mesh {}"), ElementsAre(fault_at("walls[0].mesh.triangles", "set file to an STL file")));
  EXPECT_THAT(faults_of("mesh { file: \"a.stl\" }"),
              ElementsAre(fault_at("walls[0].mesh.triangles", "together with a case file")));
}

TEST(MeshFile, ItsTrianglesComeIntoTheCaseWithTheCaseFile) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "mesh_file_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "sheet.stl") << "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 10 0 0\nvertex 0 10 "
                                         "0\nendloop\nendfacet\nendsolid s\n";
  std::ofstream(folder / "bad.stl") << "not an STL file";
  const auto read = [&](const std::string& file) {
    std::ofstream(folder / "case.txtpb") << case_text(with_wall("mesh { file: \"" + file + "\" scale: 0.001 open_sheet: true }"));
    return read_case_file(folder / "case.txtpb");
  };
  const CaseRead good = read("sheet.stl");
  EXPECT_THAT(good.faults, IsEmpty());
  ASSERT_EQ(good.value.walls(0).mesh().triangles_size(), 1);
  EXPECT_EQ(good.value.walls(0).mesh().triangles(0).b().x(), 10);
  EXPECT_FALSE(good.value.walls(0).mesh().has_file());  // stands alone: it is read again as it is
  EXPECT_THAT(read_case(case_text(good.value)).faults, IsEmpty());
  EXPECT_THAT(read("bad.stl").faults, ElementsAre(fault_at("walls[0].mesh.file", "is no STL file: neither begins with 'solid'")));
  EXPECT_THAT(read("none.stl").faults, ElementsAre(fault_at("walls[0].mesh.file", "cannot be read: No such file")));
}

}  // namespace
}  // namespace bedflow
