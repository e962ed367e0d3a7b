// Convection schemes against their definition in normalised variables, φ_f(φ_C) with φ_U = 0 and φ_D = 1 (Leonard 1988).
#include "models/convection.h"

#include <gtest/gtest.h>

#include <random>

namespace bedflow {
namespace {

template <class Scheme>
double face(double upstream) {
  return upstream + Scheme()(upstream, 1 - upstream);
}

TEST(Smart, IsGaskellAndLausPiecewiseLine) {
  for (const auto& [upstream, expected] :
       {std::pair{1.0 / 12, 3.0 / 12}, {1.0 / 6, 0.5}, {0.5, 0.75}, {5.0 / 6, 1.0}, {0.9, 1.0}})
    EXPECT_NEAR(face<Smart>(upstream), expected, 1e-15) << upstream;
  EXPECT_NEAR(face<Smart>(0.4), 3.0 / 8 + 0.75 * 0.4, 1e-15);  // QUICK
}

TEST(Superbee, IsRoesPiecewiseLine) {
  for (const auto& [upstream, expected] :
       {std::pair{0.2, 0.4}, {1.0 / 3, 2.0 / 3}, {0.4, 0.7}, {0.5, 0.75}, {0.6, 0.9}, {0.8, 1.0}})
    EXPECT_NEAR(face<Superbee>(upstream), expected, 1e-15) << upstream;
}

template <class Scheme>
class Limited : public testing::Test {};
using LimitedSchemes = testing::Types<Smart, Superbee>;
TYPED_TEST_SUITE(Limited, LimitedSchemes);

TYPED_TEST(Limited, IsUpwindAtAnExtremum) {
  const TypeParam scheme;
  for (const double upstream : {-0.1, -5.0, 1.1, 7.0}) EXPECT_EQ(face<TypeParam>(upstream), upstream);
  EXPECT_EQ(scheme(0, 0), 0);
  EXPECT_EQ(scheme(1, 0), 0);
  EXPECT_EQ(scheme(0, 1), 0);
}

TYPED_TEST(Limited, IsExactOnALine) {
  EXPECT_EQ(TypeParam()(3, 3), 1.5);
}

TYPED_TEST(Limited, IsOddAndStaysBetweenTheCellsBesideTheFace) {
  const TypeParam scheme;
  std::mt19937 random(1);
  std::normal_distribution<double> any;
  for (int n = 0; n < 10000; ++n) {
    const double behind = any(random), ahead = any(random), here = scheme(behind, ahead);
    ASSERT_EQ(scheme(-behind, -ahead), -here);
    ASSERT_DOUBLE_EQ(scheme(4 * behind, 4 * ahead), 4 * here);  // no scale of its own
    ASSERT_GE(here * ahead, 0);
    ASSERT_LE(std::abs(here), std::abs(ahead));
    ASSERT_LE(std::abs(here), 2 * std::abs(behind));  // 3 φ_C in normalised variables
  }
}

}  // namespace
}  // namespace bedflow
