#include "models/drag.h"

#include <gtest/gtest.h>

namespace bedflow {
namespace {

const DragScene scene{1.2, 1.8e-5, 1.2e-3};
constexpr auto pi = std::numbers::pi;

// Calls take(law) for every law but the constant.
template <class Take>
void each_law(Take take) {
  [&]<class... Laws>(std::variant<Laws...>*) {
    const auto unless_constant = [&]<class Law>(Law law) {
      if constexpr (!std::is_same_v<Law, ConstantDrag>) take(law);
    };
    (unless_constant(Laws{}), ...);
  }(static_cast<Drag*>(nullptr));
}

// ---------------------------------------------------------------------------------------------------- against the publications

struct State {
  double slip, fraction;  // m/s, 1
};
constexpr std::array<State, 5> states{{{0.02, 0.45}, {0.6, 0.62}, {3, 0.795}, {0.6, 0.9}, {25, 0.995}}};

template <class Law>
void expect_rows(Law law, std::array<double, 5> expected) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double b = law(scene, states[i].slip, states[i].fraction);
    EXPECT_NEAR(b / expected[i], 1, 2e-12) << Law::name << " at state " << i;  // the rows have 13 digits
  }
}

// b of one particle, worked out in Python from the formula as it is printed, with φ = 1 − ε and 𝒱 = πd³/6:
//   from a coefficient β per volume (β v = force per volume of suspension), b = β 𝒱/φ:
//     Ergun           β = 150 φ² μ/(ε d²) + 1.75 ρ φ v/d
//     Wen–Yu          β = ¾ C_D ρ ε φ v ε^−2.65/d,  C_D = 24/Re (1 + 0.15 Re^0.687) or 0.44
//     Syamlal–O'Brien β = ¾ φ ε ρ (0.63 + 4.8 √(V_r/Re))² v/(V_r² d)
//     Koch–Hill       β = 18 μ ε² φ F/d²
//   from a force on the particle, b = F/v:
//     Schiller–Naumann ½ ρ C_D v² πd²/4;  Di Felice C_D (π/8) d² ρ (ε v)² ε^−β;  Beetstra 3π μ d (ε v) F;  Tenneti ε · 3π μ d (ε
//     v) F
TEST(Drag, EveryLawGivesTheNumbersOfItsPublication) {
  expect_rows(GidaspowBlended{},
              {2.104378414194e-06, 1.988759798601e-06, 4.618570969044e-06, 8.097759114993e-07, 7.725794534309e-06});
  expect_rows(Gidaspow{}, {2.105118405317e-06, 1.989783445085e-06, 5.187540050407e-06, 8.057426562359e-07, 7.526416117928e-06});
  expect_rows(WenYu{}, {1.891523502701e-06, 1.837810417748e-06, 2.442135358066e-06, 8.057426562359e-07, 7.526416117928e-06});
  expect_rows(Ergun{}, {2.105118405317e-06, 1.989783445085e-06, 5.187540050407e-06, 1.138513177661e-06, 3.959259236002e-05});
  expect_rows(SchillerNaumann{},
              {2.457493760310e-07, 6.399190624595e-07, 1.521896478710e-06, 6.399190624595e-07, 7.464424144929e-06});
  expect_rows(DiFelice{}, {1.822028897838e-06, 1.533475751950e-06, 2.573822339544e-06, 8.420527146462e-07, 9.302642149389e-06});
  expect_rows(SyamlalObrien{},
              {1.319131525441e-06, 1.814821691515e-06, 3.521300667329e-06, 1.018127549417e-06, 9.406784737893e-06});
  expect_rows(KochHill{}, {2.490336470368e-06, 1.725578566286e-06, 3.042494083244e-06, 9.590742030136e-07, 8.529092380945e-06});
  expect_rows(Beetstra{}, {2.528234054843e-06, 2.038398205220e-06, 3.243156084316e-06, 9.878060871645e-07, 1.148396494196e-05});
  expect_rows(Tenneti{}, {2.354677160481e-06, 1.876691606088e-06, 2.271368469599e-06, 8.713547136230e-07, 5.893839462171e-06});
}

// Model A: ε Δp/L = n b v with v the interstitial slip; superficial U = ε v.
TEST(Drag, ErgunGivesTheErgunPressureDrop) {
  for (const double fraction : {0.38, 0.5, 0.7}) {
    for (const double superficial : {0.01, 0.3, 3.0}) {
      const double slip = superficial / fraction;
      const double number = (1 - fraction) / (pi / 6 * std::pow(scene.diameter, 3));  // particles per m³
      const double drop = number * Ergun{}(scene, slip, fraction) * slip / fraction;
      const double ergun =
          150 * std::pow(1 - fraction, 2) / std::pow(fraction, 3) * scene.viscosity * superficial /
              (scene.diameter * scene.diameter) +
          1.75 * (1 - fraction) / std::pow(fraction, 3) * scene.density * superficial * superficial / scene.diameter;
      EXPECT_NEAR(drop / ergun, 1, 1e-13) << fraction << " " << superficial;
    }
  }
}

// Slow flow through a packing: Δp/L = 180 φ² μ U/(ε³ d²) (Carman 1937), so b = 30π μ d φ/ε in model A; one factor of ε more or
// less would show as 0.6 or 1.7.
TEST(Drag, LawsOfResolvedSimulationsTendToCarmansPackedBed) {
  const double fraction = 0.4, carman = 30 * pi * scene.viscosity * scene.diameter * 0.6 / fraction;
  EXPECT_NEAR(KochHill{}(scene, 0, fraction) / carman, 1, 1e-12);
  EXPECT_NEAR(Beetstra{}(scene, 0, fraction) / carman, 1, 0.01);  // and ε² (1 + 1.5 √φ) = 0.35 beside 37.5
  EXPECT_NEAR(Tenneti{}(scene, 0, fraction) / carman, 1, 0.15);   // fitted up to φ = 0.5
}

// ---------------------------------------------------------------------------------------------------- limits

TEST(Drag, OneSlowParticleInClearGasFeelsStokesDrag) {
  const double stokes = 3 * pi * scene.viscosity * scene.diameter;
  EXPECT_NEAR(SchillerNaumann{}(scene, 0, 1) / stokes, 1, 1e-15);
  EXPECT_NEAR(WenYu{}(scene, 0, 1) / stokes, 1, 1e-15);
  EXPECT_NEAR(Gidaspow{}(scene, 0, 1) / stokes, 1, 1e-15);
  EXPECT_NEAR(Beetstra{}(scene, 0, 1) / stokes, 1, 1e-15);
  EXPECT_NEAR(Tenneti{}(scene, 0, 1) / stokes, 1, 1e-15);
  EXPECT_NEAR(KochHill{}(scene, 0, 1) / stokes, 1, 1e-15);
  // Dalla Valle's C_D tends to 4.8²/Re, not 24/Re.
  EXPECT_NEAR(DiFelice{}(scene, 0, 1) / stokes, 4.8 * 4.8 / 24, 1e-15);
  EXPECT_NEAR(SyamlalObrien{}(scene, 0, 1) / stokes, 4.8 * 4.8 / 24, 1e-15);
  // Of the Ergun share in the blend nothing is left but the tail of the arctangent.
  EXPECT_NEAR(GidaspowBlended{}(scene, 0, 1) / stokes, 0.5 + std::atan(262.5 * 0.2) / pi, 1e-14);
  EXPECT_EQ(Ergun{}(scene, 0, 1), 0);
}

TEST(Drag, EveryLawIsFiniteAndPositiveAlsoAtRest) {
  each_law([](auto law) {
    for (double fraction = 0.01; fraction < 1; fraction += 0.0098)
      for (const double slip : {0.0, 1e-300, 1e-12, 1e-3, 0.1, 3.0, 1e3}) {
        const double b = law(scene, slip, fraction);
        EXPECT_TRUE(std::isfinite(b) && b > 0) << law.name << " " << slip << " " << fraction;
      }
  });
}

// A rounding beyond 1 is not a reason to stop.
TEST(Drag, EveryLawBearsAFractionOfOneAndARounding) {
  each_law([](auto law) {
    const double beyond = law(scene, 0.3, 1 + 1e-15), at = law(scene, 0.3, 1);
    EXPECT_NEAR(beyond, at, 1e-12 * WenYu{}(scene, 0.3, 1)) << law.name;
  });
}

// ---------------------------------------------------------------------------------------------------- continuity

// The largest jump of b, relative, over a fine sweep of one variable; a smooth law changes by less than 0.5 % a step.
template <class Law>
double largest_jump_in_slip(Law law, double fraction) {
  double largest = 0, before = law(scene, 1e-3, fraction);
  for (double slip = 1e-3; slip < 40; slip *= 1.001) {
    const double b = law(scene, slip, fraction);
    largest = std::max(largest, std::abs(b / before - 1));
    before = b;
  }
  return largest;
}
template <class Law>
double largest_jump_in_fraction(Law law, double slip, double from, double to) {
  double largest = 0, before = law(scene, slip, from);
  for (double fraction = from; fraction <= to; fraction += 1e-5) {
    const double b = law(scene, slip, fraction);
    largest = std::max(largest, std::abs(b - before) / std::max(before, scene.stokes()));  // Ergun's b falls to 0
    before = b;
  }
  return largest;
}

TEST(Drag, EveryLawIsContinuousInTheSlip) {
  each_law([](auto law) {
    for (const double fraction : {0.4, 0.65, 0.85, 0.95, 0.995, 1.0})
      EXPECT_LT(largest_jump_in_slip(law, fraction), 0.006) << law.name << " " << fraction;
  });
}

TEST(Drag, OnlyTheSharpSwitchAndKochHillJumpInTheFraction) {
  each_law([]<class Law>(Law law) {
    for (const double slip : {0.0, 0.1, 3.0}) {
      const double jump = largest_jump_in_fraction(law, slip, 0.36, 0.9999);
      if constexpr (std::is_same_v<Law, Gidaspow>) {
        EXPECT_NEAR(jump, std::abs(WenYu{}(scene, slip, 0.8) / Ergun{}(scene, slip, 0.8) - 1), 1e-3);
      } else if constexpr (std::is_same_v<Law, KochHill>) {
        EXPECT_LT(jump, 0.3);  // F0(0.01) = 1.28 against 1 at φ = 0.01
        EXPECT_LT(largest_jump_in_fraction(law, slip, 0.36, 0.9899), 0.02);
      } else {
        EXPECT_LT(jump, 0.01) << Law::name << " " << slip;
      }
    }
  });
}

TEST(Drag, WenYuSwitchesAtReynolds1000WithTheGapOfTheCorrelations) {
  const double at_1000 = 1000 * scene.viscosity / (scene.density * scene.diameter);
  // 24/1000 (1 + 0.15·1000^0.687) = 0.4383 against 0.44: a gap of less than 0.4 %.
  const double below = WenYu{}(scene, at_1000 * (1 - 1e-12), 1.0), above = WenYu{}(scene, at_1000 * (1 + 1e-12), 1.0);
  EXPECT_NEAR(below / above, 0.024 * (1 + 0.15 * std::pow(1000, 0.687)) / 0.44, 1e-10);
  EXPECT_NEAR(below / above, 1, 0.004);
}

TEST(Drag, BlendIsHalfAndHalfAtFourFifthsAndTendsToItsParts) {
  const double slip = 0.5;
  EXPECT_DOUBLE_EQ(GidaspowBlended{}(scene, slip, 0.8), 0.5 * (WenYu{}(scene, slip, 0.8) + Ergun{}(scene, slip, 0.8)));
  // arctan(x)/π = ½ − 1/(πx): at |ε − 0.8| = 0.4 the other law has a share of 1/(π·262.5·0.4) = 0.30 %.
  const double share = 0.5 - std::atan(262.5 * 0.4) / pi;
  EXPECT_NEAR(GidaspowBlended{}(scene, slip, 0.4), (1 - share) * Ergun{}(scene, slip, 0.4) + share * WenYu{}(scene, slip, 0.4),
              1e-18);
}

// Hill, Koch & Ladd's two branches meet: the discriminant of where is positive at every φ.
TEST(Drag, KochHillsBranchesMeetAtEveryFraction) {
  for (double fraction = 0.3; fraction < 1; fraction += 0.001)
    for (double slip = 1e-4; slip < 100; slip *= 1.1)
      EXPECT_GE(KochHill{}(scene, slip * 1.1, fraction), KochHill{}(scene, slip, fraction) * (1 - 1e-12)) << fraction;
}

}  // namespace
}  // namespace bedflow
