// statistics.log -> series, profiles and intervals.
#include "statistics_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "record_log.h"

namespace bedflow {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

class StatisticsFile : public testing::Test {
 protected:
  StatisticsFile() : path_(std::filesystem::temp_directory_path() / ("bedflow_statistics_" + std::to_string(::getpid()))) {
    std::filesystem::remove(path_);
  }
  ~StatisticsFile() override { std::filesystem::remove(path_); }

  // A series "height" and a profile "voids" of two places; both averaged from 1 s in bins of 2 s.
  void write_schema() {
    v1::StatisticsRecord record;
    auto* series = record.mutable_schema()->add_monitors();
    series->set_name("height");
    series->set_unit("m");
    auto* profile = record.mutable_schema()->add_monitors();
    profile->set_name("voids");
    profile->set_is_profile(true);
    profile->add_places(0.25);
    profile->add_places(0.75);
    for (auto* monitor : {series, profile}) {
      monitor->set_averaging_start(1);
      monitor->set_averaging_bin(2);
    }
    write(record);
  }
  void write_sample(std::uint64_t step, double value) {
    v1::StatisticsRecord record;
    record.mutable_sample()->set_step(step);
    record.mutable_sample()->set_time(0.1 * static_cast<double>(step));
    record.mutable_sample()->set_value(value);
    write(record);
  }
  void write_bin(std::uint32_t monitor, std::uint32_t bin, std::uint64_t step, const std::vector<double>& mean) {
    v1::StatisticsRecord record;
    auto* closed = record.mutable_bin();
    closed->set_monitor(monitor);
    closed->set_bin(bin);
    closed->set_step(step);
    for (const double value : mean) {
      closed->add_mean(value);
      closed->add_deviation(value / 10);
    }
    write(record);
  }
  void write_resumed(std::uint64_t step) {
    v1::StatisticsRecord record;
    record.mutable_resumed()->set_step(step);
    write(record);
  }
  void write(const v1::StatisticsRecord& record) { write_bytes(record.SerializeAsString()); }
  void write_bytes(const std::string& payload) { LogWriter(path_).append(0, payload); }

  v1::Statistics read(const StatisticsQuery& query = {}) const { return read_statistics(path_, query); }

  std::filesystem::path path_;
};

TEST(Estimate, OfTwelveBinsUsesStudentsQuantileOfElevenDegrees) {
  std::vector<double> means;
  for (int i = 1; i <= 12; ++i) means.push_back(i);
  const v1::Estimate result = estimate(means);
  EXPECT_DOUBLE_EQ(result.mean(), 6.5);
  EXPECT_EQ(result.bins(), 12U);
  // s² = Σ(i − 6.5)²/11 = 13; t(0.975, 11) = 2.200985 in the tables, which give six digits
  EXPECT_NEAR(result.half_width(), 2.200985 * std::sqrt(13.0 / 12.0), 1e-6);
}

TEST(Estimate, LeavesOutBinsWithoutAValue) {
  const v1::Estimate result = estimate(std::vector{not_a_number, 1.0, not_a_number, 3.0});
  EXPECT_EQ(result.bins(), 2U);
  EXPECT_DOUBLE_EQ(result.mean(), 2);
  EXPECT_NEAR(result.half_width(), 12.70620, 1e-4);  // t(0.975, 1) · √2/√2
}

TEST(Estimate, OfOneBinHasNoIntervalAndOfNoneNoMean) {
  EXPECT_TRUE(estimate(std::vector{1.0}).has_mean());
  EXPECT_FALSE(estimate(std::vector{1.0}).has_half_width());
  EXPECT_FALSE(estimate(std::vector{not_a_number}).has_mean());
  EXPECT_EQ(estimate({}).bins(), 0U);
}

TEST_F(StatisticsFile, GivesSeriesAndProfilesBack) {
  write_schema();
  for (std::uint64_t step = 1; step <= 3; ++step) write_sample(step, 10.0 * static_cast<double>(step));
  write_bin(0, 0, 30, {5});
  write_bin(1, 0, 30, {0.4, 0.6});
  write_bin(1, 1, 50, {0.6, not_a_number});
  const v1::Statistics found = read();
  ASSERT_EQ(found.series_size(), 1);
  EXPECT_THAT(found.series(0).step(), ElementsAre(1U, 2U, 3U));
  EXPECT_THAT(found.series(0).value(), ElementsAre(10, 20, 30));
  EXPECT_DOUBLE_EQ(found.series(0).average().mean(), 5);
  ASSERT_EQ(found.profiles_size(), 1);
  EXPECT_THAT(found.profiles(0).place(), ElementsAre(0.25, 0.75));
  EXPECT_DOUBLE_EQ(found.profiles(0).average(0).mean(), 0.5);
  EXPECT_EQ(found.profiles(0).average(1).bins(), 1U);
  EXPECT_DOUBLE_EQ(found.profiles(0).deviation(0).mean(), 0.05);
  EXPECT_EQ(found.step(), 50U);
  EXPECT_DOUBLE_EQ(found.time(), 5);
}

// As engines write it a sample is read by a way of its own.
TEST_F(StatisticsFile, ASampleIsReadInWhateverFormItIsWritten) {
  write_schema();
  v1::Sample sample;
  sample.set_step(std::numeric_limits<std::uint64_t>::max());  // ten bytes
  sample.set_time(2.5);
  sample.set_value(-1e300);
  const std::string without_monitor = sample.SerializeAsString();
  sample.set_monitor(0);
  const std::string plain = sample.SerializeAsString();
  const std::string step = plain.substr(2, 11), time_and_value = plain.substr(13);
  const std::string unknown = "\x78\x01";                                // field 15
  const std::string twice = std::string("\x21") + std::string(8, '\0');  // a value that a later one replaces
  for (const auto& bytes : {plain, without_monitor, time_and_value + step, unknown + plain, plain + unknown, twice + plain}) {
    std::string record = "\x12";
    record += static_cast<char>(bytes.size());
    v1::StatisticsRecord expected;
    ASSERT_TRUE(expected.ParseFromString(record + bytes) && expected.has_sample());
    ASSERT_EQ(expected.sample().step(), sample.step());
    write_bytes(record + bytes);
  }
  const auto statistics = read();
  ASSERT_EQ(statistics.series(0).value_size(), 6);
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(statistics.series(0).step(i), sample.step()) << i;
    EXPECT_EQ(statistics.series(0).time(i), 2.5) << i;
    EXPECT_EQ(statistics.series(0).value(i), -1e300) << i;
  }
}

TEST_F(StatisticsFile, StepsRunAgainReplaceTheEarlierOnes) {
  write_schema();
  for (std::uint64_t step = 1; step <= 5; ++step) write_sample(step, 1);
  write_bin(1, 0, 5, {0.1, 0.1});
  write_resumed(3);
  for (std::uint64_t step = 4; step <= 6; ++step) write_sample(step, 2);
  write_bin(1, 0, 6, {0.7, 0.8});
  const v1::Statistics found = read();
  EXPECT_THAT(found.series(0).step(), ElementsAre(1U, 2U, 3U, 4U, 5U, 6U));
  EXPECT_THAT(found.series(0).value(), ElementsAre(1, 1, 1, 2, 2, 2));
  EXPECT_EQ(found.profiles(0).average(0).bins(), 1U);
  EXPECT_DOUBLE_EQ(found.profiles(0).average(0).mean(), 0.7);
}

TEST_F(StatisticsFile, BinsOfStepsThatAResumeUndidAreGone) {
  write_schema();
  write_bin(0, 0, 3, {1});
  write_bin(0, 1, 5, {2});
  write_resumed(3);
  EXPECT_EQ(read().series(0).average().bins(), 1U);
  EXPECT_EQ(read().step(), 3U);
}

TEST_F(StatisticsFile, ThinningKeepsMinimumMaximumAndMean) {
  write_schema();
  double sum = 0;
  for (std::uint64_t step = 0; step < 103; ++step) {
    const double value = step == 37 ? 1e3 : (step == 61 ? -1e3 : std::sin(0.3 * static_cast<double>(step)));
    write_sample(step, value);
    sum += value;
  }
  StatisticsQuery query;
  query.most = 10;
  const v1::Statistics statistics = read(query);
  const v1::Series& found = statistics.series(0);
  ASSERT_EQ(found.value_size(), 10);
  EXPECT_DOUBLE_EQ(*std::max_element(found.maximum().begin(), found.maximum().end()), 1e3);
  EXPECT_DOUBLE_EQ(*std::min_element(found.minimum().begin(), found.minimum().end()), -1e3);
  EXPECT_TRUE(std::is_sorted(found.step().begin(), found.step().end()));
  EXPECT_EQ(found.step(9), 102U);
  double kept = 0;
  std::uint32_t samples = 0;
  for (int i = 0; i < 10; ++i) {
    kept += found.value(i) * found.samples(i);
    samples += found.samples(i);
    EXPECT_GE(found.samples(i), 10U);
    EXPECT_LE(found.minimum(i), found.value(i));
    EXPECT_GE(found.maximum(i), found.value(i));
  }
  EXPECT_EQ(samples, 103U);
  EXPECT_NEAR(kept, sum, 1e-9);  // sums of 103 values, the largest 1000: round-off
  query.most = 103;
  EXPECT_EQ(read(query).series(0).value_size(), 103);
  EXPECT_EQ(read(query).series(0).minimum_size(), 0);
}

TEST_F(StatisticsFile, StepsOfAQueryBoundItsSamples) {
  write_schema();
  for (std::uint64_t step = 0; step < 10; ++step) write_sample(step, 0);
  StatisticsQuery query;
  query.from_step = 7;
  EXPECT_THAT(read(query).series(0).step(), ElementsAre(7U, 8U, 9U));
  query.to_step = 8;
  query.from_time = 0.75;
  EXPECT_THAT(read(query).series(0).step(), ElementsAre(8U));
  query.from_step = 9;
  EXPECT_EQ(read(query).series(0).step_size(), 0);
}

TEST_F(StatisticsFile, IsFollowedAsItGrows) {
  write_schema();
  write_sample(1, 1);
  StatisticsLog log(path_);
  log.update();
  EXPECT_EQ(log.series().at(0).samples(), 1U);
  write_sample(2, 2);
  write_sample(3, 3);
  write_resumed(2);
  write_sample(3, 4);
  log.update();
  EXPECT_THAT(log.answer({}).series(0).value(), ElementsAre(1, 2, 4));
  const v1::SeriesInfo info = log.series().at(0);
  EXPECT_EQ(info.samples(), 3U);
  EXPECT_EQ(info.last_step(), 3U);
  EXPECT_EQ(info.monitor().name(), "height");
  EXPECT_TRUE(log.series().at(1).monitor().is_profile());
}

TEST_F(StatisticsFile, TimesOfAQueryBoundItsSamples) {
  write_schema();
  for (std::uint64_t step = 0; step < 10; ++step) write_sample(step, 0);
  StatisticsQuery query;
  query.from_time = 0.25;
  query.to_time = 0.55;
  EXPECT_THAT(read(query).series(0).step(), ElementsAre(3U, 4U, 5U));
}

TEST_F(StatisticsFile, NamesChooseMonitorsAndAnUnknownOneNamesThoseThereAre) {
  write_schema();
  StatisticsQuery query;
  query.names = {"voids"};
  EXPECT_EQ(read(query).series_size(), 0);
  EXPECT_EQ(read(query).profiles_size(), 1);
  query.names = {"nothing"};
  try {
    read(query);
    FAIL() << "an unknown name was taken";
  } catch (const std::out_of_range& fault) {
    EXPECT_THAT(fault.what(), HasSubstr("height, voids"));
  }
}

TEST_F(StatisticsFile, ThatIsNotThereYetIsEmpty) {
  EXPECT_EQ(read().series_size(), 0);
  EXPECT_FALSE(read().has_step());
}

TEST_F(StatisticsFile, WithATornEndIsReadUpToIt) {
  write_schema();
  write_sample(1, 1);
  write_sample(2, 2);
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) - 3);
  EXPECT_THAT(read().series(0).step(), ElementsAre(1U));
}

TEST_F(StatisticsFile, DamagedBeforeItsEndIsRefused) {
  write_schema();
  write_sample(1, 1);
  std::fstream(path_, std::ios::in | std::ios::out | std::ios::binary).seekp(30).put('?');
  EXPECT_THROW(read(), std::system_error);
}

}  // namespace
}  // namespace bedflow
