// Profiles fill what a case leaves open, and only that.
#include "fidelity.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "bedflow/v1/study.pb.h"
#include "case_file.h"
#include "cases/ready_cases.h"

namespace bedflow {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

v1::Case with(v1::Case value, v1::Fidelity fidelity) {
  leave_open(value);
  value.set_fidelity(fidelity);
  complete(value);
  return value;
}

TEST(Fidelity, EveryReadyCaseIsSoundWithEveryProfile) {
  for (const auto& ready : ready_cases())
    for (const auto& profile : profiles())
      EXPECT_THAT(check_case(with(ready_case(ready.name), profile.fidelity)), IsEmpty())
          << ready.name << " " << v1::Fidelity_Name(profile.fidelity);
}

TEST(Fidelity, ACaseThatNamesOneNeedSayNoNumerics) {
  v1::Case open = ready_case("mueller");
  leave_open(open);
  EXPECT_FALSE(open.gas().has_simple() || open.gas().has_upwind() || open.coupling().has_hat());
  EXPECT_TRUE(open.coupling().has_gidaspow_blended() && open.particles().has_spring()) << "physics is the user's";
  EXPECT_THAT(read_case(case_text(open)).faults, Not(IsEmpty()));
  const auto read = read_case("fidelity: BALANCED " + case_text(open));
  EXPECT_THAT(read.faults, IsEmpty());
  EXPECT_EQ(case_text(read.value), case_text(with(open, v1::BALANCED)));
}

TEST(Fidelity, WhatTheCaseSaysStays) {
  v1::Case value = ready_case("mueller");
  leave_open(value);
  value.mutable_particles()->set_steps_per_collision(33);
  value.mutable_gas()->mutable_simple()->set_tolerance(0.25);
  value.mutable_coupling()->mutable_semi_implicit();
  value.mutable_coupling()->set_displacement(false);
  value.mutable_time()->set_step(1e-5);
  value.set_fidelity(v1::FAST);
  complete(value);
  EXPECT_EQ(value.particles().steps_per_collision(), 33);
  EXPECT_EQ(value.gas().simple().tolerance(), 0.25);
  EXPECT_TRUE(value.coupling().has_semi_implicit());
  EXPECT_FALSE(value.coupling().displacement());
  EXPECT_EQ(value.time().step(), 1e-5);
  EXPECT_FALSE(value.time().has_substeps()) << "a step is given already";
  EXPECT_TRUE(value.coupling().has_hat()) << "left open";
  const auto once = case_text(value);
  complete(value);
  EXPECT_EQ(case_text(value), once);
}

TEST(Fidelity, PartsThatACaseLacksStayAway) {
  v1::Case gas = with(ready_case("channel"), v1::REFERENCE);
  EXPECT_FALSE(gas.has_particles() || gas.has_coupling() || gas.time().has_substeps());
  EXPECT_TRUE(gas.time().has_step()) << "gas alone has no other";
  EXPECT_FALSE(with(ready_case("drop"), v1::REFERENCE).has_gas());
}

TEST(Fidelity, ExplainTellsWhereACaseStands) {
  v1::Case value = with(ready_case("mueller"), v1::BALANCED);
  EXPECT_THAT(standing_text(value), testing::StartsWith("BALANCED; "));
  value.mutable_particles()->set_steps_per_collision(16);
  EXPECT_THAT(standing_text(value), testing::StartsWith("BALANCED, but particles.steps_per_collision 16 (20); "));
  value.clear_fidelity();
  EXPECT_THAT(standing_text(value), HasSubstr("none named; nearest to BALANCED, but particles.steps_per_collision 16 (20)"));
}

// What is told of a profile is what the study that is kept has measured.
TEST(Fidelity, SaysWhatWasMeasured) {
  for (const std::string bed : {"mueller", "goldschmidt"}) {
    const std::filesystem::path file =
        std::filesystem::path(BEDFLOW_SOURCE_DIR) / "tests/validation/fidelity" / (bed + "-fidelity.json");
    std::stringstream text;
    text << std::ifstream(file).rdbuf();
    v1::Study study;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(text.str(), &study).ok()) << file;
    const auto& reference = study.runs(static_cast<int>(study.spec().reference()));
    for (int i = 0; i < study.runs_size(); ++i) {
      const auto& name = study.spec().points(i).values(0);
      const auto profile =
          std::ranges::find_if(profiles(), [&](const auto& one) { return v1::Fidelity_Name(one.fidelity) == name; });
      ASSERT_NE(profile, profiles().end()) << name;
      std::array<char, 64> expected{};
      if (profile->fidelity == v1::REFERENCE) {
        std::snprintf(expected.data(), expected.size(), "%s %.0f CPU s", bed.c_str(), study.runs(i).cost().cpu_seconds());
      } else {
        const auto& height = study.runs(i).errors(0);
        const double speed = reference.cost().cpu_seconds() / study.runs(i).cost().cpu_seconds();
        const double percent = 100 / reference.quantities(0).mean();
        std::snprintf(expected.data(), expected.size(), "%s %.1f x, bed height %+.1f ± %.1f %%", bed.c_str(), speed,
                      percent * height.value(), percent * height.half_width());
      }
      EXPECT_THAT(profile->measured, HasSubstr(expected.data()));
    }
  }
}

}  // namespace
}  // namespace bedflow
