// The ready cases are good, and say what they should; presets change the laws and nothing else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>

#include "case_file.h"
#include "cases/ready_cases.h"
#include "support/case_faults.h"

namespace bedflow {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const std::vector<std::string> beds{"goldschmidt-1.25", "goldschmidt-1.5", "goldschmidt-2", "mueller", "link-b1",
                                    "link-b2",          "link-b3",         "sscp-2",        "sscp-3",  "sscp-4"};

double mass(const v1::Particles& particles) {
  return particles.density() * std::numbers::pi / 6 * std::pow(particles.diameter(), 3);
}

// τ = π / √(k/m* − (η/2m*)²) with m* = m/2 and η = 2 √(m* k) |ln e| / √(π² + ln² e).
double collision_time(const v1::Particles& particles) {
  const double k = particles.linear_spring_dashpot().stiffness();
  const double log_e = std::log(particles.linear_spring_dashpot().restitution());
  const double reduced = mass(particles) / 2;
  const double damping = 2 * std::sqrt(reduced * k) * std::abs(log_e) / std::hypot(std::numbers::pi, log_e);
  return std::numbers::pi / std::sqrt(k / reduced - std::pow(damping / (2 * reduced), 2));
}

TEST(ReadyCases, AreGoodAndNamedAsTheySay) {
  for (const ReadyCase& ready : ready_cases()) {
    EXPECT_THAT(read_case(ready_case_text(ready.name)).faults, IsEmpty()) << ready.name;
    EXPECT_FALSE(ready.description.empty()) << ready.name;
    EXPECT_THAT(ready.description, Not(HasSubstr("@"))) << ready.name;
    if (ready.description.starts_with("short for")) continue;
    EXPECT_EQ(ready_case(ready.name).name(), ready.name);
  }
}

TEST(ReadyCases, HaveTheTenConditions) {
  std::set<std::string_view> names;
  for (const ReadyCase& ready : ready_cases()) names.insert(ready.name);
  for (const std::string& bed : beds) EXPECT_TRUE(names.contains(bed)) << bed;
  EXPECT_EQ(ready_case_text("link"), ready_case_text("link-b2"));
}

TEST(ReadyCases, UnknownNameNamesThoseThereAre) {
  EXPECT_THROW(ready_case("moeller"), std::out_of_range);
  EXPECT_THROW(ready_case("mueller", "none"), std::out_of_range);
  try {
    ready_case_text("moeller");
  } catch (const std::out_of_range& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("mueller"));
  }
}

TEST(ReadyCases, HaveThePublishedCollisionTimesWeightsAndCells) {
  struct Expected {
    double time, weight_per_area, cell_ratio;
  };
  const std::map<std::string, Expected> expected{{"goldschmidt-1.5", {2.00e-4, 2203.4, 2.008}},
                                                 {"mueller", {1.007e-4, 186.4, 2.068}},
                                                 {"link-b2", {1.0005e-4, 2962.9, 1.588}},
                                                 {"sscp-3", {3.18e-4, 1080.5, 1.944}}};
  for (const auto& [name, want] : expected) {
    const v1::Case value = ready_case(name);
    const v1::Lengths& size = value.domain().size();
    const v1::Cells& cells = value.domain().cells();
    const v1::Particles& particles = value.particles();
    EXPECT_NEAR(collision_time(particles), want.time, 5e-4 * want.time) << name;  // printed to three or four digits
    const double weight = particles.random().count() * mass(particles) * 9.81 / (size.x() * size.z());
    EXPECT_NEAR(weight, want.weight_per_area, 0.06) << name;  // printed to 0.1 Pa
    const double volume = size.x() / cells.x() * size.y() / cells.y() * size.z() / cells.z();
    EXPECT_NEAR(std::cbrt(volume) / particles.diameter(), want.cell_ratio, 6e-4) << name;  // printed to 0.001
  }
}

TEST(ReadyCases, RunThroughTheirAveraging) {
  for (const std::string& bed : beds) {
    const v1::Case value = ready_case(bed);
    for (const v1::Monitor& monitor : value.monitors()) {
      if (!monitor.has_averaging()) continue;
      EXPECT_DOUBLE_EQ(monitor.averaging().start() + monitor.averaging().bin() * monitor.averaging().bins(), value.time().end())
          << bed;
    }
  }
}

TEST(ReadyCases, SeedSparselyEnoughAndGiveTimeToSettle) {
  for (const std::string& bed : beds) {
    const v1::Case value = ready_case(bed);
    const v1::Vector& high = value.particles().random().region().high();
    const double volume = high.x() * high.y() * high.z();
    const double fraction = value.particles().random().count() * mass(value.particles()) / value.particles().density() / volume;
    EXPECT_GT(fraction, 0.25) << bed;
    EXPECT_LT(fraction, 0.30) << bed;
    EXPECT_GE(value.particles().random().settling().duration(), std::sqrt(2 * high.y() / 9.81) + 0.3) << bed;
  }
}

TEST(ReadyCases, CarryTheReferenceDataInSi) {
  const v1::Case goldschmidt = ready_case("goldschmidt-2");
  EXPECT_EQ(goldschmidt.references_size(), 12);
  EXPECT_DOUBLE_EQ(goldschmidt.references(0).points(0).value(), 0.135);
  EXPECT_DOUBLE_EQ(goldschmidt.references(1).points(0).half_width(), 0.0061);
  EXPECT_TRUE(goldschmidt.references(11).fluctuation());
  const v1::Case mueller = ready_case("mueller");
  EXPECT_EQ(mueller.references_size(), 5);
  EXPECT_EQ(mueller.references(0).points_size(), 22);
  for (const v1::Reference& reference : mueller.references()) {
    for (const v1::Point& point : reference.points()) {
      EXPECT_GT(point.x(), 0);
      EXPECT_LT(point.x(), mueller.domain().size().x());
    }
  }
  EXPECT_EQ(ready_case("sscp-3").references_size(), 8);
}

TEST(Presets, RunWithEveryBed) {
  EXPECT_EQ(ready_presets().size(), 6);
  for (const std::string& bed : beds)
    for (const ReadyCase& preset : ready_presets())
      EXPECT_THAT(check_case(ready_case(bed, preset.name)), IsEmpty()) << bed << " " << preset.name;
}

// The table of the models that the paper compares.
TEST(Presets, SayWhatTheirRowSays) {
  struct Row {
    const char *tangential, *kernel, *exchange, *convection;
    bool displacement, grows;
  };
  const std::map<std::string, Row> rows{{"mfix-exa-2018", {"coulomb", "hat", "explicit", "upwind", false, false}},
                                        {"mfix-garg-upwind", {"spring", "garg", "sub_stepped", "upwind", false, true}},
                                        {"mfix-garg-smart", {"spring", "garg", "sub_stepped", "smart", false, true}},
                                        {"mfix-dpvm-upwind", {"spring", "square_dpvm", "explicit", "upwind", true, false}},
                                        {"mfix-dpvm-smart", {"spring", "square_dpvm", "explicit", "smart", true, false}},
                                        {"bedflow", {"spring", "hat", "explicit", "superbee", true, false}}};
  const auto arm = [](const google::protobuf::Message& message, const char* choice) {
    const auto* oneof = message.GetDescriptor()->FindOneofByName(choice);
    return message.GetReflection()->GetOneofFieldDescriptor(message, oneof)->name();
  };
  for (const ReadyCase& preset : ready_presets()) {
    const v1::Case value = ready_case("mueller", preset.name);
    const Row& row = rows.at(std::string(preset.name));
    EXPECT_EQ(arm(value.particles(), "tangential"), row.tangential) << preset.name;
    EXPECT_EQ(arm(value.coupling(), "kernel"), row.kernel) << preset.name;
    EXPECT_EQ(arm(value.coupling(), "exchange"), row.exchange) << preset.name;
    EXPECT_EQ(arm(value.gas(), "convection"), row.convection) << preset.name;
    EXPECT_EQ(value.coupling().displacement(), row.displacement) << preset.name;
    EXPECT_EQ(value.time().longest_step(), row.grows ? 0.1 : 0) << preset.name;
    EXPECT_FALSE(value.time().has_step()) << preset.name;  // it begins with τ
    EXPECT_EQ(value.particles().steps_per_collision(), 20) << preset.name;
  }
}

TEST(Presets, KeepTheFrictionOfTheCase) {
  const v1::Case value = ready_case("goldschmidt-1.5", "mfix-exa-2018");
  EXPECT_DOUBLE_EQ(value.particles().coulomb().friction(), 0.10);
  EXPECT_DOUBLE_EQ(value.particles().coulomb().wall_friction(), 0.09);
  EXPECT_FALSE(value.coupling().displacement());
  EXPECT_DOUBLE_EQ(ready_case("goldschmidt-1.5", "mfix-dpvm-smart").particles().spring().friction(), 0.10);
}

TEST(Presets, ChangeLawsOnly) {
  v1::Case changed = ready_case("sscp-3", "mfix-garg-smart");
  v1::Case plain = ready_case("sscp-3");
  EXPECT_EQ(changed.name(), "sscp-3-mfix-garg-smart");
  for (v1::Case* value : {&changed, &plain}) {
    value->clear_name();
    value->clear_coupling();
    value->mutable_time()->clear_longest_step();
    value->mutable_gas()->clear_convection();
    value->mutable_particles()->clear_tangential();
  }
  EXPECT_EQ(changed.DebugString(), plain.DebugString());
}

TEST(Presets, LeaveOutWhatTheSceneLacks) {
  EXPECT_FALSE(ready_case("settling", "mfix-exa-2018").has_gas());
  EXPECT_THAT(check_case(ready_case("settling", "mfix-exa-2018")), IsEmpty());
  EXPECT_THAT(check_case(ready_case("channel", "mfix-exa-2018")), IsEmpty());
}

}  // namespace
}  // namespace bedflow
