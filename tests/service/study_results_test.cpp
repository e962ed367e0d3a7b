// What a study makes of the statistics of its runs: by numbers worked out by hand.
#include "study_results.h"

#include <gtest/gtest.h>

#include <cmath>

namespace bedflow::server {
namespace {

v1::Estimate estimate(double mean, double half_width, std::uint32_t bins = 5) {
  v1::Estimate value;
  value.set_mean(mean);
  value.set_half_width(half_width);
  value.set_bins(bins);
  return value;
}

v1::StudyQuantity quantity(const std::string& monitor, bool fluctuation = false) {
  v1::StudyQuantity value;
  value.set_monitor(monitor);
  value.set_fluctuation(fluctuation);
  return value;
}

TEST(StudyResults, ASeriesKeepsItsSignAndAProfileIsARootMeanSquare) {
  v1::Statistics statistics;
  auto& series = *statistics.add_series();
  series.set_name("velocity");
  *series.mutable_average() = estimate(-3, 0.5);
  *series.mutable_deviation() = estimate(1, 0.25);
  auto& profile = *statistics.add_profiles();
  profile.set_name("fraction");
  *profile.add_average() = estimate(3, 1);
  *profile.add_average() = estimate(4, 7);
  *profile.add_average() = v1::Estimate();  // nothing was seen there
  EXPECT_EQ(overall(measured(statistics, quantity("velocity"))).mean(), -3);
  EXPECT_EQ(overall(measured(statistics, quantity("velocity", true))).half_width(), 0.25);
  EXPECT_DOUBLE_EQ(overall(measured(statistics, quantity("fraction"))).mean(), std::sqrt((9 + 16) / 2.0));
  EXPECT_DOUBLE_EQ(overall(measured(statistics, quantity("fraction"))).half_width(), 5);
  EXPECT_TRUE(measured(statistics, quantity("unknown")).mean.empty());
}

TEST(StudyResults, AnErrorHasTheIntervalsOfBothRuns) {
  const Measured reference{{10}, {0.3}, 5};
  const auto error = difference({{10.4}, {0.4}, 5}, reference);
  EXPECT_NEAR(error.value(), 0.4, 1e-12);
  EXPECT_NEAR(error.half_width(), 0.5, 1e-12);
  EXPECT_TRUE(error.equal());
  EXPECT_FALSE(difference({{10.6}, {0.4}, 5}, reference).equal());
  EXPECT_FALSE(difference({{10.6}, {NAN}, 1}, reference).has_equal());  // without an interval nothing is said
  EXPECT_FALSE(difference({{1, 2}, {0, 0}, 5}, reference).has_value());
  const auto of_profile = difference({{1, 5, NAN}, {0, 0, NAN}, 5}, {{4, 1, 7}, {0, 0, 0}, 5});
  EXPECT_DOUBLE_EQ(of_profile.value(), std::sqrt((9 + 16) / 2.0));
}

TEST(StudyResults, ARunHasSaidEnoughWhenEveryBinCountAndWidthIs) {
  v1::StudyStop stop;
  stop.set_relative(0.05);
  stop.set_bins(4);
  EXPECT_TRUE(is_narrow_enough({{-10}, {0.5}, 4}, stop));
  EXPECT_FALSE(is_narrow_enough({{-10}, {0.51}, 4}, stop));
  EXPECT_FALSE(is_narrow_enough({{-10}, {0.5}, 3}, stop));
  EXPECT_FALSE(is_narrow_enough({}, stop));
}

TEST(StudyResults, TheFrontLeavesOutWhatAnotherBeats) {
  v1::Study study;
  study.mutable_spec()->add_quantities();
  const auto add = [&](double cost, double error, double half_width, bool has_ended = true) {
    auto& run = *study.add_runs();
    if (has_ended) run.mutable_cost()->set_cpu_seconds(cost);
    auto& difference = *run.add_errors();
    difference.set_value(error);
    difference.set_half_width(half_width);
    difference.set_equal(std::abs(error) <= half_width);
  };
  add(10, 0, 0.1);          // the reference
  add(5, -0.05, 0.1);       // equal to it and cheaper: it beats the reference
  add(3, 1.0, 0.1);         // cheaper still, at a price
  add(4, 2.0, 0.1);         // dearer and worse than the third
  add(1, 0.5, 0.1, false);  // has not ended
  mark_front(study);
  const bool expected[] = {false, true, true, false, false};
  for (int i = 0; i < study.runs_size(); ++i) EXPECT_EQ(study.runs(i).on_front(0), expected[i]) << i;
}

}  // namespace
}  // namespace bedflow::server
