// Size distributions against their closed forms: moments of the law to round-off, of samples within four standard errors, the
// whole sample by Kolmogorov's test.
#include "particles/sizes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "particles/random.h"

namespace bedflow {
namespace {

constexpr double exact = 1e-12;  // relative: round-off of sums over up to a hundred pieces

double normal_cdf(double x) {
  return 0.5 * std::erfc(-x / std::sqrt(2.0));
}
double normal_density(double x) {
  return std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
}

std::vector<double> sample(const SizeDistribution& sizes, std::size_t count) {
  Random random(11);
  std::vector<double> diameters(count);
  for (double& d : diameters) d = sizes.quantile(random.uniform());
  return diameters;
}

// Mean and Sauter diameter of a sample within four standard errors of the law's (m₃/m₂ by the delta method), and the largest
// distance of its cumulative share from the law's below Kolmogorov's limit at 0.1 %, 1.95/√n.
void expect_drawn_from(const SizeDistribution& sizes, const std::function<double(double)>& cumulative) {
  std::vector<double> drawn = sample(sizes, 20000);
  const auto n = static_cast<double>(drawn.size());
  double mean = 0, m2 = 0, m3 = 0;
  for (const double d : drawn) mean += d / n, m2 += d * d / n, m3 += d * d * d / n;
  EXPECT_NEAR(mean, sizes.mean(), 4 * std::sqrt((sizes.moment(2) - std::pow(sizes.mean(), 2)) / n));
  const double d32 = sizes.sauter();
  const double variance =
      (sizes.moment(6) - 2 * d32 * sizes.moment(5) + d32 * d32 * sizes.moment(4)) / std::pow(sizes.moment(2), 2);
  EXPECT_NEAR(m3 / m2, d32, 4 * std::sqrt(variance / n));
  std::ranges::sort(drawn);
  double furthest = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const double share = cumulative(drawn[i]);
    furthest =
        std::max({furthest, std::abs(share - static_cast<double>(i) / n), std::abs(share - static_cast<double>(i + 1) / n)});
  }
  EXPECT_LT(furthest, 1.95 / std::sqrt(n));
  for (const double u : {0.0, 0.003, 0.2, 0.5, 0.77, 0.999}) EXPECT_NEAR(cumulative(sizes.quantile(u)), u, 1e-11);
}

TEST(Sizes, AConstantSizeIsThatSize) {
  const SizeDistribution sizes(ConstantSize{1.5e-3}, Basis::mass);
  EXPECT_TRUE(sizes.constant());
  EXPECT_EQ(sizes.quantile(0.7), 1.5e-3);
  EXPECT_NEAR(sizes.moment(3), std::pow(1.5e-3, 3), 1e-24);
}

TEST(Sizes, UniformByNumberHasTheMomentsOfAUniformDensity) {
  const double a = 0.5e-3, b = 2.5e-3;
  const SizeDistribution sizes(UniformSizes{a, b});
  for (const int k : {1, 2, 3, 6}) {
    const double closed = (std::pow(b, k + 1) - std::pow(a, k + 1)) / ((k + 1) * (b - a));
    EXPECT_NEAR(sizes.moment(k), closed, exact * closed) << k;
  }
  expect_drawn_from(sizes, [&](double d) { return (d - a) / (b - a); });
}

// n = c/d³, c = 2/(a⁻² − b⁻²)
TEST(Sizes, UniformByMassHasASmallSizeMoreOften) {
  const double a = 0.5e-3, b = 2.5e-3, c = 2 / (1 / (a * a) - 1 / (b * b));
  const SizeDistribution sizes(UniformSizes{a, b}, Basis::mass);
  EXPECT_NEAR(sizes.mean(), c * (1 / a - 1 / b), exact * a);
  EXPECT_NEAR(sizes.moment(2), c * std::log(b / a), exact * a * a);
  EXPECT_NEAR(sizes.moment(3), c * (b - a), exact * b * b * b);
  expect_drawn_from(sizes, [&](double d) { return c / 2 * (1 / (a * a) - 1 / (d * d)); });
}

TEST(Sizes, NormalIsCutOffAtBothEnds) {
  const double mu = 1e-3, s = 0.2e-3, a = 0.7e-3, b = 1.6e-3;
  const SizeDistribution sizes(NormalSizes{mu, s, a, b});
  const double alpha = (a - mu) / s, beta = (b - mu) / s, z = normal_cdf(beta) - normal_cdf(alpha);
  const double shift = (normal_density(alpha) - normal_density(beta)) / z;
  const double mean = mu + s * shift;
  const double variance = s * s * (1 + (alpha * normal_density(alpha) - beta * normal_density(beta)) / z - shift * shift);
  EXPECT_NEAR(sizes.mean(), mean, exact * mean);
  EXPECT_NEAR(sizes.moment(2), mean * mean + variance, exact * mean * mean);
  EXPECT_EQ(sizes.smallest(), a);
  EXPECT_EQ(sizes.largest(), b);
  expect_drawn_from(sizes, [&](double d) { return (normal_cdf((d - mu) / s) - normal_cdf(alpha)) / z; });
}

// The mass of a by-mass normal law is normal: E[d³ dᵏ]/E[d³] are the moments of the normal law.
TEST(Sizes, NormalByMassWeighsAsTheLawSays) {
  const SizeDistribution by_number(NormalSizes{1e-3, 0.2e-3, 0.7e-3, 1.6e-3});
  const SizeDistribution by_mass(NormalSizes{1e-3, 0.2e-3, 0.7e-3, 1.6e-3}, Basis::mass);
  for (const int k : {-3, 1, 2})
    EXPECT_NEAR(by_mass.moment(3 + k) / by_mass.moment(3), by_number.moment(k), exact * by_number.moment(k)) << k;
  expect_drawn_from(by_mass, [&](double d) {
    return SizeDistribution(NormalSizes{1e-3, 0.2e-3, 0.7e-3, d}).moment(-3) *
           (normal_cdf((d - 1e-3) / 0.2e-3) - normal_cdf(-1.5)) / (by_number.moment(-3) * (normal_cdf(3) - normal_cdf(-1.5)));
  });
}

TEST(Sizes, ANarrowNormalLawInAWideRangeIsResolved) {
  const SizeDistribution sizes(NormalSizes{1e-3, 1e-8, 1e-6, 1});
  EXPECT_NEAR(sizes.mean(), 1e-3, 1e-15);
  EXPECT_NEAR(sizes.quantile(normal_cdf(1)), 1e-3 + 1e-8, 1e-16);
}

// E[dᵏ] = mᵏ e^(k²s²/2) (Φ(β − ks) − Φ(α − ks))/(Φ(β) − Φ(α)),  α, β = ln(ends/m)/s
TEST(Sizes, LogNormalIsCutOffAtBothEnds) {
  const double m = 0.8e-3, s = 0.4, alpha = std::log(0.3e-3 / m) / s, beta = std::log(3e-3 / m) / s;
  const SizeDistribution sizes(LogNormalSizes{m, s, 0.3e-3, 3e-3});
  const double z = normal_cdf(beta) - normal_cdf(alpha);
  for (const int k : {-3, 1, 2, 3, 6}) {
    const double closed =
        std::pow(m, k) * std::exp(k * k * s * s / 2) * (normal_cdf(beta - k * s) - normal_cdf(alpha - k * s)) / z;
    EXPECT_NEAR(sizes.moment(k), closed, exact * closed) << k;
  }
  expect_drawn_from(sizes, [&](double d) { return (normal_cdf(std::log(d / m) / s) - normal_cdf(alpha)) / z; });
}

// A log-normal law by mass is log-normal by number, its median smaller by e^(−3s²) (Hatch & Choate 1929).
TEST(Sizes, LogNormalByMassIsHatchAndChoates) {
  const double m = 0.8e-3, s = 0.4;
  const SizeDistribution by_mass(LogNormalSizes{m, s, 1e-7, 1}, Basis::mass),
      by_number(LogNormalSizes{m * std::exp(-3 * s * s), s, 1e-7, 1});
  for (const int k : {1, 2, 3, 6}) EXPECT_NEAR(by_mass.moment(k), by_number.moment(k), exact * by_number.moment(k)) << k;
  for (const double u : {1e-3, 0.5, 0.99}) EXPECT_NEAR(by_mass.quantile(u), by_number.quantile(u), 1e-11 * m);
}

TEST(Sizes, DiscreteSizesComeByTheirSharesOfNumberOrMass) {
  const DiscreteSizes law{{{2e-3, 3}, {1e-3, 1}}};  // in any order, of any sum
  const SizeDistribution by_number(law), by_mass(law, Basis::mass);
  EXPECT_EQ(by_number.quantile(0.2499), 1e-3);
  EXPECT_EQ(by_number.quantile(0.2501), 2e-3);
  const double small = 1 / (1 + 3.0 / 8);  // 1 of mass at 1 mm, 3 at 2 mm where each weighs 8 times as much
  EXPECT_EQ(by_mass.quantile(small - 1e-4), 1e-3);
  EXPECT_EQ(by_mass.quantile(small + 1e-4), 2e-3);
  EXPECT_NEAR(by_mass.moment(3), 1e-9 * (small + 8 * (1 - small)), exact * 1e-9);
  const std::vector<double> drawn = sample(by_mass, 20000);
  const double share = static_cast<double>(std::ranges::count(drawn, 1e-3)) / 20000;
  EXPECT_NEAR(share, small, 4 * std::sqrt(small * (1 - small) / 20000));  // four standard errors
}

TEST(Sizes, AHistogramIsUniformWithinItsClasses) {
  const HistogramSizes law{0.5e-3, {{1e-3, 2}, {1.5e-3, 0}, {2e-3, 6}}};
  const SizeDistribution by_number(law), by_mass(law, Basis::mass);
  EXPECT_NEAR(by_number.mean(), 0.25 * 0.75e-3 + 0.75 * 1.75e-3, exact * 1e-3);
  expect_drawn_from(by_number, [](double d) {
    return d < 1e-3 ? 0.25 * (d - 0.5e-3) / 0.5e-3 : 0.25 + 0.75 * std::max(0.0, d - 1.5e-3) / 0.5e-3;
  });
  // Of the mass a quarter is below 1 mm: E[d³; d < 1 mm] = E[d³]/4, and within a class n ∝ d⁻³.
  const double light = 2 / 0.5e-3 / 2 * (1 / std::pow(0.5e-3, 2) - 1 / std::pow(1e-3, 2));
  const double heavy = 6 / 0.5e-3 / 2 * (1 / std::pow(1.5e-3, 2) - 1 / std::pow(2e-3, 2));
  EXPECT_NEAR(by_mass.quantile(light / (light + heavy) * (1 - 1e-12)), 1e-3, 1e-12);
  EXPECT_NEAR(by_mass.moment(3), 8 / (light + heavy), exact * 1e-9);
}

TEST(Sizes, TheMomentsOfABedAreThoseOfAllRanks) {
  const Comm world = Comm::world();
  const std::vector<double> diameters{1e-3, 2e-3, 2e-3, 4e-3, 1.5e-3};
  SizeSums sums(1e-3);
  for (std::size_t i = 0; i < diameters.size(); ++i)
    if (static_cast<int>(i) % world.size() == world.rank()) sums.add(diameters[i], 2 * diameters[i]);
  const SizeMoments moments = sums.over_all(world);
  EXPECT_EQ(moments.count, 5);
  EXPECT_NEAR(moments.mean, 2.1e-3, 1e-17);
  EXPECT_NEAR(moments.deviation, std::sqrt((1 + 4 + 4 + 16 + 2.25) / 5 - 2.1 * 2.1) * 1e-3, 1e-16);
  EXPECT_NEAR(moments.sauter, (1 + 8 + 8 + 64 + 3.375) / (1 + 4 + 4 + 16 + 2.25) * 1e-3, 1e-17);
  EXPECT_EQ(moments.smallest, 1e-3);
  EXPECT_EQ(moments.largest, 4e-3);
  EXPECT_NEAR(moments.mass, 2 * 10.5e-3, 1e-16);
}

TEST(Sizes, EqualSizesHaveNoDeviation) {
  SizeSums sums(1.2e-3);
  for (int i = 0; i < 1000; ++i) sums.add(1.2e-3, 1);
  EXPECT_EQ(sums.over_all(Comm::self()).deviation, 0);
  EXPECT_EQ(SizeSums(1).over_all(Comm::self()).count, 0);
}

}  // namespace
}  // namespace bedflow
