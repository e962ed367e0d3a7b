// What a particle and the gas do to each other within a step: models/exchange.h.
#include "models/exchange.h"

#include <gtest/gtest.h>

#include "particles/integrate.h"

namespace bedflow {
namespace {

TEST(Exchange, FeltShareIsTheMeanOfTheSlipOverTheStep) {
  for (const double x : {1e-9, 1e-3, 0.3, 1.0, 7.0, 30.0}) {
    double left = 1, sum = 0;
    const int n = 20;
    for (int s = 0; s < n; ++s) {
      sum += left / n;
      left *= 1 - x / n;
    }
    // Differences of 1 and (1 − x/n)^n: 1e-16 over x.
    EXPECT_NEAR(SubStepped::felt(x, n), sum, 1e-15 + 2e-16 / x) << x;
    EXPECT_NEAR(SemiImplicit::felt(x, n), (1 - std::exp(-x)) / x, 1e-15 + 2e-16 / x) << x;
    EXPECT_EQ(Explicit::felt(x, n), 1);
  }
  EXPECT_EQ(SubStepped::felt(0, 20), 1);
  EXPECT_EQ(SemiImplicit::felt(0, 20), 1);
  EXPECT_NEAR(SemiImplicit::felt(1e9, 1), 1e-9, 1e-24);
}

const ParticleType type{1, 2.5, false};  // radius, density, one size

// One particle in gas that streams by at a given velocity, under gravity; it does not act on the gas.
struct Drift {
  Vec3 velocity, debt;
};
template <class Scheme>
Drift drift(const Scheme& scheme, double rate, double dt, int steps, int substeps) {
  const Vec3 gas{0.5, 2, -1};
  const DemSetup setup{.types = {type}, .gravity = {0, -9.81, 0}, .gas = GasForce::relaxed};
  const double b = rate * type.mass();
  ParticleStore one;
  one.add(0, {}, {-0.3, 0.1, 0.2}, {});
  one.gas_force.resize(1);
  one.gas_response.resize(1);
  std::vector<ForceRow> force(1);
  const std::vector<Vec3> place(2);
  const double h = dt / substeps;
  for (int s = 0; s < steps; ++s) {
    one.gas_force[0] = b * gas;
    one.gas_response[0] = {b, scheme.felt_in_substep(rate * h), {}};
    for (int n = 0; n < substeps; ++n)
      integrate<GasForce::relaxed, false, false, false>(setup, type, 0, 1, one, force.data(), place.data(), 1e150, h);
  }
  return {one.velocity(0), one.gas_response[0].debt};
}

// V → U + g/λ with rate λ = b/m, from m/b a hundredth of the step to a million steps.
TEST(Exchange, SemiImplicitFollowsTheExactExponentialWhateverTheStep) {
  for (const double rate : {1e-6, 1e-3, 0.1, 1.0, 3.0, 10.0, 100.0}) {  // b/m in 1/dt
    const Vec3 end = Vec3{0.5, 2, -1} + (1 / rate) * Vec3{0, -9.81, 0};
    const Vec3 start{-0.3, 0.1, 0.2}, exact = start - std::expm1(-rate * 3) * (end - start);
    const Vec3 got = drift(SemiImplicit{}, rate, 1, 3, 20).velocity;
    EXPECT_LT(norm(got - exact), 1e-13 * (norm(exact) + 9.81 * 3)) << rate;  // 60 roundings
  }
}

TEST(Exchange, SubSteppedFollowsItToFirstOrderAndLeavesItBeyondItsLimit) {
  const Vec3 end = Vec3{0.5, 2, -1} + Vec3{0, -9.81, 0};
  const Vec3 exact = end + std::exp(-1.0) * (Vec3{-0.3, 0.1, 0.2} - end);
  const auto error = [&](int substeps) { return norm(drift(SubStepped{}, 1, 1, 1, substeps).velocity - exact); };
  EXPECT_NEAR(std::log2(error(20) / error(40)), 1, 0.05);
  EXPECT_LT(norm(drift(SubStepped{}, 1.9 * 20, 1, 50, 20).velocity), 10);
  EXPECT_GT(norm(drift(SubStepped{}, 2.1 * 20, 1, 50, 20).velocity), 1e10);
}

// The gas is told ψ b (U − V) − (1 − ψ) m g before the particle moves; free of contacts it receives just that.
TEST(Exchange, WhatAFreeParticleReceivesIsWhatTheGasWasTold) {
  const double mass = type.mass(), dt = 1;
  const Vec3 gravity{0, -9.81, 0}, slip = Vec3{0.5, 2, -1} - Vec3{-0.3, 0.1, 0.2};
  const auto told = [&](double felt, double rate) { return dt * mass * (felt * rate * slip - (1 - felt) * gravity); };
  for (const double rate : {1e-6, 0.1, 1.0, 10.0, 100.0}) {
    const Vec3 received = drift(SemiImplicit{}, rate, dt, 1, 20).debt;
    const Vec3 expected = told(SemiImplicit::felt(rate * dt, 20), rate);
    EXPECT_LT(norm(received - expected), 1e-13 * (norm(expected) + mass * 9.81 * dt)) << rate;
    if (rate > 40) continue;  // its limit
    const Vec3 in_steps = drift(SubStepped{}, rate, dt, 1, 20).debt;
    EXPECT_LT(norm(in_steps - told(SubStepped::felt(rate * dt, 20), rate)), 1e-13 * (norm(expected) + mass * 9.81 * dt)) << rate;
  }
}

}  // namespace
}  // namespace bedflow
