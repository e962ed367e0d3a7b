// Text and JSON -> Case: faults carry their place and say what to do; hostile text is survived.
#include <gmock/gmock.h>
#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <random>

#include "case_file.h"
#include "cases/ready_cases.h"
#include "support/case_faults.h"

namespace bedflow {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

std::vector<CaseFault> faults_of(const std::string& text) {
  return read_case(text).faults;
}

std::string replaced(std::string text, const std::string& old_part, const std::string& new_part) {
  const std::size_t place = text.find(old_part);
  EXPECT_NE(place, std::string::npos) << old_part;
  return text.replace(place, old_part.size(), new_part);
}

std::string mueller() {
  return ready_case_text("mueller");
}

TEST(CaseText, UnknownFieldsAreAllToldWithTheNearestName) {
  const std::string text =
      replaced(replaced(mueller(), "viscosity: 1.8e-5", "viscosity: 1.8e-5 viscosty: 1"), "seed:", "sed: 1 seed:");
  EXPECT_THAT(faults_of(text), ElementsAre(Field(&CaseFault::text, AllOf(HasSubstr("viscosty"), HasSubstr("mean viscosity?"))),
                                           Field(&CaseFault::text, AllOf(HasSubstr("sed"), HasSubstr("mean seed?")))));
}

TEST(CaseText, FieldInTheWrongBlockIsToldWhereItBelongs) {
  EXPECT_THAT(faults_of("gas { restitution: 0.9 }"),
              Contains(fault_at("line 1, column 18", "it belongs in LinearSpringDashpot")));
}

TEST(CaseText, MisspeltRequiredFieldIsToldAsMissingToo) {
  EXPECT_THAT(faults_of(replaced(mueller(), "viscosity:", "viscosty:")), Contains(fault_at("gas.viscosity", "is missing")));
}

TEST(CaseText, TwoArmsOfAChoiceAreRefused) {
  EXPECT_THAT(faults_of("gas {\n  upwind {}\n  smart {}\n}"),
              ElementsAre(fault_at("line 3, column 9", "both upwind and smart are set, but only one convection can be")));
}

TEST(CaseText, FieldSetTwiceIsRefused) {
  EXPECT_THAT(faults_of("name: \"a\" name: \"b\""), ElementsAre(fault_at("line 1, column 15", "name is set twice")));
}

TEST(CaseText, WrongTypesAreRefusedInPlace) {
  EXPECT_THAT(faults_of("gas { density: \"x\" }"), ElementsAre(fault_at("line 1, column 16", "Expected double")));
  EXPECT_THAT(faults_of("particles { random { count: -3 } }"), ElementsAre(fault_at("line 1, column 29", "not negative")));
  EXPECT_THAT(faults_of("particles { random { count: 2.5 } }"), ElementsAre(fault_at("line 1, column 29", "Expected integer")));
  EXPECT_THAT(faults_of("domain { periodic { x: maybe } }"), ElementsAre(fault_at("line 1, column 30", "maybe")));
  EXPECT_THAT(faults_of("gas: 3"), ElementsAre(fault_at("line 1, column 6", "a block is expected")));
  EXPECT_THAT(faults_of("gas { density 3 }"), ElementsAre(fault_at("line 1, column 15", "write name: value")));
}

TEST(CaseText, BlockWithoutEndIsTold) {
  EXPECT_THAT(faults_of("gas { density: 3 "), ElementsAre(Field(&CaseFault::text, HasSubstr("a } is missing"))));
}

TEST(CaseText, NestedWithoutEndIsRefusedNotFollowed) {
  for (const std::string opening : {"gas {", "gas <", "x [", "{\"gas\":", "{\"a\":[["}) {
    std::string text;
    for (int i = 0; i < 200'000; ++i) text += opening;
    EXPECT_THAT(faults_of(text), Not(IsEmpty())) << opening;
    EXPECT_THAT(faults_of("{\"a\":" + text), Not(IsEmpty())) << opening;
  }
}

TEST(CaseText, CommentsAndStringsMayHoldAnyBraces) {
  const std::string braces(500, '{');
  EXPECT_THAT(faults_of("# don't " + braces + "\n" + mueller()), IsEmpty());
  EXPECT_THAT(faults_of(replaced(mueller(), "description: \"", "description: \"" + braces)), IsEmpty());
}

TEST(CaseText, EmptyTextIsToldWhatACaseNeeds) {
  EXPECT_THAT(faults_of(""), AllOf(Contains(fault_at("name", "is missing")), Contains(fault_at("domain", "is missing"))));
}

TEST(CaseText, TextOfACaseIsReadBackAsTheSameCase) {
  for (const ReadyCase& ready : ready_cases()) {
    const v1::Case value = ready_case(ready.name);
    const CaseRead again = read_case(case_text(value));
    EXPECT_THAT(again.faults, IsEmpty()) << ready.name;
    EXPECT_EQ(again.value.SerializeAsString(), value.SerializeAsString()) << ready.name;
    EXPECT_EQ(case_text(again.value), case_text(value)) << ready.name;
  }
}

TEST(CaseText, KeepsEveryBitOfANumber) {
  v1::Case value = ready_case("mueller");
  value.mutable_gas()->set_density(1.0 / 3);
  EXPECT_EQ(read_case(case_text(value)).value.gas().density(), 1.0 / 3);
  EXPECT_EQ(read_case(case_json(value)).value.gas().density(), 1.0 / 3);
}

TEST(CaseJson, OfACaseIsReadBackAsTheSameCase) {
  for (const ReadyCase& ready : ready_cases()) {
    const v1::Case value = ready_case(ready.name);
    const CaseRead again = read_case(case_json(value));
    EXPECT_THAT(again.faults, IsEmpty()) << ready.name;
    EXPECT_EQ(again.value.SerializeAsString(), value.SerializeAsString()) << ready.name;
  }
}

TEST(CaseJson, UnknownFieldsAndTwoArmsAreAllToldByPath) {
  EXPECT_THAT(faults_of(R"({"gas": {"densty": 1, "upwind": {}, "smart": {}}, "monitors": [{"name": "a"}, {"nam": "b"}]})"),
              AllOf(Contains(fault_at("gas.densty", "mean density?")), Contains(fault_at("gas.upwind", "only one convection")),
                    Contains(fault_at("monitors[1].nam", "mean name?"))));
}

TEST(CaseJson, WrongTypesAreToldByPath) {
  EXPECT_THAT(faults_of(R"({"gas": {"density": "x"}})"), ElementsAre(fault_at("gas.density", "\"x\"")));
}

TEST(CaseJson, ThatIsNotJsonIsTold) {
  EXPECT_THAT(faults_of("{\"gas\": "), ElementsAre(fault_at("JSON", "is not valid")));
  EXPECT_THAT(faults_of("{\"gas\": {\"density\": NaN}}"), ElementsAre(fault_at("JSON", "is not valid")));
}

TEST(CaseJson, NotANumberAsTextIsRefused) {
  EXPECT_THAT(faults_of(R"({"gas": {"density": "NaN", "viscosity": "Infinity"}})"),
              AllOf(Contains(fault_at("gas.density", "finite")), Contains(fault_at("gas.viscosity", "finite"))));
}

TEST(CaseFile, ThatCannotBeReadIsAFaultWithItsPath) {
  EXPECT_THAT(read_case_file("/nowhere/case.txtpb").faults,
              ElementsAre(fault_at("/nowhere/case.txtpb", "cannot be read: No such file")));
  EXPECT_THAT(read_case_file("/").faults, ElementsAre(fault_at("/", "is a folder")));
}

TEST(CaseFile, IsReadFromDisk) {
  const auto path = std::filesystem::temp_directory_path() / ("bedflow_case_" + std::to_string(::getpid()));
  std::ofstream(path) << mueller();
  EXPECT_THAT(read_case_file(path).faults, IsEmpty());
  std::filesystem::remove(path);
}

// Whatever comes in, there is an answer; a text that is not the good one is never taken for a case with other numbers.
TEST(CaseText, CutAnywhereIsRefused) {
  const std::string whole = ready_case_text("settling");
  const std::size_t monitors = whole.find("\n\nmonitors");  // what stands before them is required
  for (std::size_t cut = 0; cut < monitors; ++cut)
    EXPECT_THAT(faults_of(whole.substr(0, cut)), Not(IsEmpty())) << "cut at " << cut;
  const std::string json = case_json(ready_case("settling"));
  for (std::size_t cut = 0; cut + 2 < json.size(); ++cut)
    EXPECT_THAT(faults_of(json.substr(0, cut)), Not(IsEmpty())) << "cut at " << cut;
}

TEST(CaseText, RandomBytesAreRefused) {
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes(random() % 200, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    EXPECT_THAT(faults_of(bytes), Not(IsEmpty()));
    EXPECT_THAT(faults_of("{" + bytes), Not(IsEmpty()));
    EXPECT_THAT(faults_of("gas {" + bytes), Not(IsEmpty()));
  }
}

TEST(CaseText, DamagedBytesAreSurvivedWithBoundedFaults) {
  std::mt19937 random(4);
  const v1::Case value = ready_case("settling");
  for (const std::string& whole : {ready_case_text("settling"), case_json(value)}) {
    for (int i = 0; i < 1000; ++i) {
      std::string damaged = whole;
      for (int k = 0; k <= i % 8; ++k) damaged[random() % damaged.size()] = static_cast<char>(random());
      EXPECT_THAT(faults_of(damaged), SizeIs(testing::Le(201U)));
    }
  }
}

TEST(CaseText, DamagedMessagesFromTheWireAreSurvived) {
  const google::protobuf::LogSilencer silence;  // of its complaints about text that is not UTF-8
  std::mt19937 random(5);
  const std::string whole = ready_case("settling").SerializeAsString();
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = whole.substr(0, random() % (whole.size() + 1));
    for (int k = 0; k < i % 8 && !damaged.empty(); ++k) damaged[random() % damaged.size()] = static_cast<char>(random());
    v1::Case value;
    if (!value.ParseFromString(damaged)) continue;
    const auto faults = check_case(value);
    EXPECT_THAT(faults, Each(Field(&CaseFault::text, Not(IsEmpty()))));
    if (faults.empty()) {
      EXPECT_THAT(read_case(case_text(value)).faults, IsEmpty());
    }
  }
}

}  // namespace
}  // namespace bedflow
