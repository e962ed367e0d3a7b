#include "case_difference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cases/ready_cases.h"

namespace bedflow {

// For gmock's messages.
std::ostream& operator<<(std::ostream& out, const CaseDifference& difference) {
  return out << difference.path << ": " << difference.first << " | " << difference.second;
}

namespace {

using testing::ElementsAre;
using testing::IsEmpty;

testing::Matcher<CaseDifference> differs(const std::string& path, const std::string& first, const std::string& second) {
  return testing::AllOf(testing::Field(&CaseDifference::path, path), testing::Field(&CaseDifference::first, first),
                        testing::Field(&CaseDifference::second, second));
}

TEST(CaseDifference, NamesAndMonitorsAreNoModels) {
  v1::Case other = ready_case("mueller");
  other.set_name("another");
  other.clear_monitors();
  other.clear_output();
  other.clear_references();
  EXPECT_THAT(differences(ready_case("mueller"), other), IsEmpty());
}

TEST(CaseDifference, NumbersAreToldWithTheirUnitsAndDefaultsCount) {
  v1::Case a = ready_case("mueller"), b = a;
  b.mutable_gas()->mutable_simple()->set_velocity_relaxation(0.5);  // the default
  EXPECT_THAT(differences(a, b), IsEmpty());
  b.mutable_gas()->set_density(1.3);
  b.mutable_coupling()->set_gas_fraction_floor(0.4);
  EXPECT_THAT(differences(a, b), ElementsAre(differs("gas.density", "1.2 kg/m³", "1.3 kg/m³"),
                                             differs("coupling.gas_fraction_floor", "0.35", "0.4")));
}

TEST(CaseDifference, ArmsOfAChoiceAreToldWhole) {
  v1::Case a = ready_case("mueller"), b = a;
  b.mutable_coupling()->mutable_square_dpvm()->set_caps(true);
  EXPECT_THAT(differences(a, b), ElementsAre(differs("coupling.kernel", "hat {}", "square_dpvm { caps: true }")));
  b = a;
  b.clear_coupling();
  EXPECT_EQ(differences(a, b).size(), 1);
  EXPECT_EQ(differences(a, b).front().second, "none");
}

TEST(CaseDifference, PresetsDifferInTheirModels) {
  EXPECT_THAT(differences(ready_case("sscp-3", "mfix-dpvm-upwind"), ready_case("sscp-3", "mfix-dpvm-smart")),
              ElementsAre(differs("gas.convection", "upwind {}", "smart {}")));
  std::vector<std::string> paths;
  for (const auto& one : differences(ready_case("sscp-3", "mfix-exa-2018"), ready_case("sscp-3", "mfix-garg-upwind")))
    paths.push_back(one.path);
  EXPECT_THAT(paths,
              testing::UnorderedElementsAre("particles.tangential", "coupling.kernel", "coupling.exchange", "time.longest_step"));
}

}  // namespace
}  // namespace bedflow
