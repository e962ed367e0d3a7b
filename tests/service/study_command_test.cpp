// What `bedflow study` and `bedflow reproduce` make of what is typed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <google/protobuf/util/json_util.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>

#include "case_source.h"
#include "failure.h"
#include "reproduction.h"
#include "study_follow.h"
#include "study_page.h"
#include "study_report.h"
#include "vary.h"

namespace bedflow::client {
namespace {

using testing::HasSubstr;

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const Failure& failure) {
    return std::string(failure.what()) + " | " + failure.next;
  }
  return "nothing was refused";
}

TEST(Vary, AProfileDecidesWhateverTheCaseSays) {
  auto bed = load_case("mueller@mfix-exa-2018");
  vary(bed, "fidelity", "fast");
  const auto fast = load_case("mueller@bedflow", {"fidelity=FAST"});
  EXPECT_EQ(bed.gas().SerializeAsString(), fast.gas().SerializeAsString());
  EXPECT_EQ(bed.particles().steps_per_collision(), fast.particles().steps_per_collision());
  EXPECT_TRUE(bed.particles().has_coulomb()) << "the law of friction is no matter of fidelity";
  EXPECT_THAT(refusal([&] { vary(bed, "fidelity", "best"); }), HasSubstr("BEST"));
}

TEST(Vary, SetsMultipliesAndChooses) {
  auto bed = load_case("mueller");
  vary(bed, "particles.steps_per_collision", "12");
  EXPECT_EQ(bed.particles().steps_per_collision(), 12);
  vary(bed, "stiffness", "x0.1");
  EXPECT_DOUBLE_EQ(bed.particles().linear_spring_dashpot().stiffness(), 44);
  vary(bed, "cells", "x0.5");
  EXPECT_EQ(bed.domain().cells().x(), 9u);
  EXPECT_EQ(bed.domain().cells().y(), 24u);
  EXPECT_EQ(bed.domain().cells().z(), 2u);
  vary(bed, "cells", "x0.1");  // never none
  EXPECT_EQ(bed.domain().cells().z(), 1u);
  vary(bed, "tolerance", "x0.1");
  EXPECT_DOUBLE_EQ(bed.gas().simple().tolerance(), 1e-4);
  // Another law keeps the numbers that both name alike.
  vary(bed, "tangential", "coulomb");
  EXPECT_EQ(bed.particles().coulomb().friction(), 0.1);
  vary(bed, "coupling.kernel", "garg");
  EXPECT_TRUE(bed.coupling().has_garg());
  vary(bed, "gas.convection", "smart");
  EXPECT_TRUE(bed.gas().has_smart());
  // The gas step by one name takes the other's place.
  bed.mutable_time()->set_step(1e-4);
  vary(bed, "substeps", "5");
  EXPECT_EQ(bed.time().substeps(), 5u);
  EXPECT_FALSE(bed.time().has_step());
  vary(bed, "gas_step", "2e-4");
  EXPECT_FALSE(bed.time().has_substeps());
}

TEST(Vary, NamesWhatIsWrong) {
  auto bed = load_case("mueller");
  EXPECT_THAT(refusal([&] { vary(bed, "kernel", "hut"); }), HasSubstr("hut is none of hat, square_dpvm, garg, gaussian"));
  EXPECT_THAT(refusal([&] { vary(bed, "particles.colour", "3"); }), HasSubstr("there is no field \"colour\""));
  EXPECT_THAT(refusal([&] { vary(bed, "gas.solver.colour", "3"); }), HasSubstr("there is no field \"colour\""));
  EXPECT_THAT(refusal([&] { vary(bed, "name", "x2"); }), HasSubstr("is no number to multiply"));
  EXPECT_THAT(refusal([&] { parse_axis("substeps"); }), HasSubstr("not of the form"));
  EXPECT_THAT(refusal([&] { parse_axis("substeps=1,,2"); }), HasSubstr("empty value"));
  EXPECT_THAT(refusal([&] { parse_axis("substeps=1,1"); }), HasSubstr("twice"));
}

TEST(Vary, KnowsWhichValueIsTheFinest) {
  EXPECT_EQ(finest(parse_axis("coupling.substeps=20,1,40")), 1u);
  EXPECT_EQ(finest(parse_axis("dem.steps_per_collision=8,50,20")), 1u);
  EXPECT_EQ(finest(parse_axis("stiffness=x0.01,x1,x0.1")), 1u);
  EXPECT_THAT(refusal([] { finest(parse_axis("kernel=hat,garg")); }), HasSubstr("--reference kernel=garg"));
  for (const auto& knob : knobs()) EXPECT_FALSE(knob.path.empty()) << knob.name;
}

// Each knob does something to a case that has its parameter.
TEST(Vary, EveryKnobTurns) {
  const std::map<std::string, std::string> settings = {{"tangential", "coulomb"},  {"integrator", "velocity_verlet"},
                                                       {"kernel", "square_dpvm"},  {"exchange", "semi_implicit"},
                                                       {"convection", "superbee"}, {"solver", "projection"},
                                                       {"displacement", "false"},  {"gas_step", "3e-5"},
                                                       {"substeps", "7"},          {"fidelity", "fast"},
                                                       {"coarse_graining", "1.5"}};
  for (const auto& knob : knobs()) {
    auto bed = load_case("mueller");
    const auto before = bed.SerializeAsString();
    const auto setting = settings.find(knob.name);
    vary(bed, knob.name, setting == settings.end() ? "x2" : setting->second);
    EXPECT_NE(bed.SerializeAsString(), before) << knob.name;
    EXPECT_TRUE(check_case(bed).empty()) << knob.name << ": " << check_case(bed).front().text;
  }
}

TEST(Reproduction, RunsEveryConditionWithEveryPreset) {
  EXPECT_EQ(conditions_of("goldschmidt").size(), 3u);
  EXPECT_EQ(conditions_of("goldschmidt-2"), std::vector<std::string>{"goldschmidt-2"});
  EXPECT_EQ(conditions_of("mueller"), std::vector<std::string>{"mueller"});
  EXPECT_EQ(conditions_of("link").size(), 3u);
  EXPECT_THAT(refusal([] { conditions_of("fluid"); }), HasSubstr("goldschmidt-1.25"));
  const auto spec = reproduction(conditions_of("goldschmidt"), {"bedflow", "mfix-exa-2018"}, Averaging{5, 2, 6});
  ASSERT_EQ(spec.points_size(), 6);
  EXPECT_EQ(spec.points(3).values(0), "goldschmidt-1.5");
  EXPECT_EQ(spec.points(3).values(1), "mfix-exa-2018");
  EXPECT_EQ(spec.points(3).case_().time().end(), 17);
  EXPECT_TRUE(spec.points(3).case_().particles().has_coulomb());
  EXPECT_FALSE(spec.same_packing());
  EXPECT_EQ(spec.quantities(0).monitor(), "bed_height");
  EXPECT_EQ(reproduction(conditions_of("mueller"), {"bedflow"}, std::nullopt).points(0).case_().time().end(), 65);  // the paper's
}

TEST(Reproduction, ComparesByThePapersMeasure) {
  EXPECT_NEAR(disagreement(10, 0.2, 11, 0.3), (1 - 0.5) / 10.5, 1e-15);
  EXPECT_LE(disagreement(10, 0.6, 11, 0.4), 0);  // the intervals just touch
  EXPECT_EQ(mirrored({1, 2, 3, 6}), (std::vector<double>{3.5, 2.5, 2.5, 3.5}));
}

v1::Estimate estimate(double mean, double half_width) {
  v1::Estimate value;
  value.set_mean(mean);
  value.set_half_width(half_width);
  value.set_bins(6);
  return value;
}

v1::Study study_of_three() {
  v1::Study study;
  study.set_id("s-000000000001");
  auto& spec = *study.mutable_spec();
  spec.set_name("mueller");
  spec.add_axes("substeps");
  spec.add_quantities()->set_monitor("bed_height");
  const double costs[] = {100, 50, 25}, heights[] = {0.02, 0.0201, 0.025};
  for (int i = 0; i < 3; ++i) {
    spec.add_points()->add_values(std::to_string(1 << i));
    auto& run = *study.add_runs();
    run.set_job("j-00000000000" + std::to_string(i));
    run.set_state(v1::SUCCEEDED);
    run.mutable_cost()->set_cpu_seconds(costs[i]);
    *run.add_quantities() = estimate(heights[i], 0.0004);
    auto& error = *run.add_errors();
    error.set_value(heights[i] - heights[0]);
    error.set_half_width(0.0005);
    error.set_equal(i < 2);
    run.add_on_front(i > 0);
  }
  return study;
}

TEST(StudyReport, TellsCostAndDifferenceAndDraws) {
  const v1::Study study = study_of_three();
  const auto table = study_table(study).text(Format::table);
  EXPECT_THAT(table, HasSubstr("0.5 % ± 2.5, equal"));
  EXPECT_THAT(table, HasSubstr("25 % ± 2.5"));
  EXPECT_THAT(table, HasSubstr("4 x"));
  EXPECT_THAT(table, HasSubstr("substeps=4"));
  const auto script = study_plot(study, "study.png");
  EXPECT_THAT(script, HasSubstr("25 25 2.5 \"4\""));
  EXPECT_THAT(script, HasSubstr("on the front"));
}

TEST(StudyReport, ARunThatIsSuspendedHasNotEnded) {
  v1::Study study = study_of_three();
  EXPECT_EQ(progress_of(study), "3 of 3 runs have ended");
  study.mutable_runs(1)->set_state(v1::STATE_SUSPENDED);
  EXPECT_EQ(progress_of(study), "2 of 3 runs have ended; suspended, resume to go on: j-000000000001");
  study.mutable_runs(1)->set_interval_met(true);
  EXPECT_EQ(progress_of(study), "3 of 3 runs have ended");
}

TEST(StudyPage, KeepsTableSharesOfPhasesFailuresPictureAndJson) {
  v1::Study study = study_of_three();
  study.mutable_spec()->set_name("mueller: gas step");
  study.mutable_spec()->set_command("bedflow study mueller");
  for (const auto& [phase, seconds] : {std::pair("contacts", 30.0), {"pressure", 9.9}, {"balance", 0.1}}) {
    auto& one = *study.mutable_runs(0)->mutable_cost()->add_phases();
    one.set_phase(phase);
    one.set_seconds(seconds);
  }
  study.mutable_runs(2)->set_state(v1::FAILED);
  study.mutable_runs(2)->set_message("a contact overlaps");
  std::string name = (std::filesystem::temp_directory_path() / "bedflow-page-XXXXXX").string();
  const std::filesystem::path folder = mkdtemp(name.data());
  const auto page = write_study_page(folder / "new", study);
  EXPECT_EQ(page, folder / "new" / "mueller-gas-step.md");
  std::stringstream text;
  text << std::ifstream(page).rdbuf();
  EXPECT_THAT(text.str(), HasSubstr("Made by `bedflow study mueller`, bedflow "));
  EXPECT_THAT(text.str(), HasSubstr("| reference | SUCCEEDED | 100 | 1 x | 0.02000 ± 0.00040 | reference |"));
  EXPECT_THAT(text.str(), HasSubstr("| run | contacts | pressure |\n|---|---|---|\n| reference | 75 | 24.8 |"));
  EXPECT_THAT(text.str(), HasSubstr("substeps=4 failed: a contact overlaps"));
  EXPECT_GT(std::filesystem::file_size(folder / "new" / "mueller-gas-step.png"), 1000);
  v1::Study read;
  std::stringstream json;
  json << std::ifstream(folder / "new" / "mueller-gas-step.json").rdbuf();
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(json.str(), &read).ok());
  EXPECT_EQ(read.SerializeAsString(), study.SerializeAsString());
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace bedflow::client
