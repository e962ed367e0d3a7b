#include "models/drag.h"

#include <gtest/gtest.h>

namespace bedflow {
namespace {

const DragScene scene{1.2, 1.8e-5, 1.2e-3};

TEST(Drag, WenYuTendsToStokesForOneSlowParticleInClearGas) {
  EXPECT_NEAR(WenYu{}(scene, 0, 1.0) / (3 * M_PI * 1.8e-5 * 1.2e-3), 1, 1e-15);
}

TEST(Drag, WenYuSwitchesAtReynolds1000WithTheGapOfTheCorrelations) {
  const double at_1000 = 1000 * scene.viscosity / (scene.density * scene.diameter);
  // 24/1000 (1 + 0.15·1000^0.687) = 0.4383 against 0.44: a gap of less than 0.4 %.
  const double below = WenYu{}(scene, at_1000 * (1 - 1e-12), 1.0), above = WenYu{}(scene, at_1000 * (1 + 1e-12), 1.0);
  EXPECT_NEAR(below / above, 0.024 * (1 + 0.15 * std::pow(1000, 0.687)) / 0.44, 1e-10);
  EXPECT_NEAR(below / above, 1, 0.004);
}

// Model A: ε Δp/L = n b v with v the interstitial slip; superficial U = ε v.
TEST(Drag, ErgunGivesTheErgunPressureDrop) {
  for (const double fraction : {0.38, 0.5, 0.7}) {
    for (const double superficial : {0.01, 0.3, 3.0}) {
      const double slip = superficial / fraction;
      const double number = (1 - fraction) / (M_PI / 6 * std::pow(scene.diameter, 3));  // particles per m³
      const double drop = number * Ergun{}(scene, slip, fraction) * slip / fraction;
      const double ergun =
          150 * std::pow(1 - fraction, 2) / std::pow(fraction, 3) * scene.viscosity * superficial /
              (scene.diameter * scene.diameter) +
          1.75 * (1 - fraction) / std::pow(fraction, 3) * scene.density * superficial * superficial / scene.diameter;
      EXPECT_NEAR(drop / ergun, 1, 1e-13) << fraction << " " << superficial;
    }
  }
}

TEST(Drag, BlendIsHalfAndHalfAtFourFifthsAndTendsToItsParts) {
  const double slip = 0.5;
  EXPECT_DOUBLE_EQ(GidaspowBlended{}(scene, slip, 0.8), 0.5 * (WenYu{}(scene, slip, 0.8) + Ergun{}(scene, slip, 0.8)));
  // arctan(x)/π = ½ − 1/(πx): at |ε − 0.8| = 0.4 the other law has a share of 1/(π·262.5·0.4) = 0.30 %.
  const double share = 0.5 - std::atan(262.5 * 0.4) / M_PI;
  EXPECT_NEAR(GidaspowBlended{}(scene, slip, 0.4), (1 - share) * Ergun{}(scene, slip, 0.4) + share * WenYu{}(scene, slip, 0.4),
              1e-18);
}

TEST(Drag, EveryLawIsFiniteAndPositiveAtRest) {
  for (const double fraction : {0.35, 0.8, 1.0}) {
    EXPECT_GT(GidaspowBlended{}(scene, 0, fraction), 0);
    EXPECT_TRUE(std::isfinite(GidaspowBlended{}(scene, 0, fraction)));
    EXPECT_GT(WenYu{}(scene, 0, fraction), 0);
  }
  EXPECT_EQ(Ergun{}(scene, 0, 1.0), 0);
}

}  // namespace
}  // namespace bedflow
