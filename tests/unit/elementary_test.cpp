#include "base/elementary.h"

#include <gtest/gtest.h>

#include <random>

namespace bedflow {
namespace {

// y log2 x is right to 2^-53 of its size, up to 20 here: 20 ln 2 · 1.1e-16 and the few roundings of the series.
TEST(Elementary, PowerIsTheCLibrarysToRoundOff) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-12, 8), fraction(0.05, 1);
  for (int i = 0; i < 100000; ++i) {
    const double x = std::pow(10.0, exponent(random)), e = fraction(random);
    EXPECT_NEAR(power(x, 0.687) / std::pow(x, 0.687), 1, 1e-14) << x;
    EXPECT_NEAR(power(e, -2.65) / std::pow(e, -2.65), 1, 4e-15) << e;
  }
}

TEST(Elementary, PowerIsExactAtOneAndNextToNothingAtZero) {
  EXPECT_EQ(power(1, -1.65), 1);
  EXPECT_EQ(power(4, 0.5), 2);
  EXPECT_EQ(power(1024, -0.5), 1.0 / 32);
  EXPECT_GE(power(0, 0.343), 0);
  EXPECT_LT(power(0, 0.343), 1e-100);
}

TEST(Elementary, ExponentialStaysFinite) {
  EXPECT_EQ(exponential2(-5000), exponential2(-1022));
  EXPECT_TRUE(std::isfinite(exponential2(5000)));
  for (double t = -40; t < 40; t += 0.0137) EXPECT_NEAR(exponential2(t) / std::exp2(t), 1, 1e-15) << t;
}

TEST(Elementary, ArctangentIsTheCLibrarysToRoundOff) {
  for (double x = -300; x < 300; x += 0.00317) EXPECT_NEAR(arctangent(x), std::atan(x), 5e-16) << x;
  for (double x = 1e-12; x < 1; x *= 1.01) EXPECT_NEAR(arctangent(x) / std::atan(x), 1, 1e-15) << x;
  EXPECT_EQ(arctangent(0), 0);
  EXPECT_DOUBLE_EQ(arctangent(1), std::numbers::pi / 4);
  EXPECT_DOUBLE_EQ(arctangent(-1e300), -std::numbers::pi / 2);
}

}  // namespace
}  // namespace bedflow
