// statistics.log of a job folder -> series, profiles and their confidence. Used by the server's queries and the client.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bedflow/v1/results.pb.h"
#include "record_log.h"

namespace bedflow {

struct StatisticsQuery {
  std::vector<std::string> names = {};                        // all if empty
  std::optional<double> from_time = {}, to_time = {};         // s; of the samples of series
  std::optional<std::uint64_t> from_step = {}, to_step = {};  // of the same
  std::uint32_t most = 0;  // thin a series to at most so many groups of samples: mean, minimum and maximum of each; 0: all
};

// A log, and what is valid in it as it grows: steps that were run again after a resume replace the earlier ones.
class StatisticsLog {
 public:
  explicit StatisticsLog(std::filesystem::path path) : path_(path), reader_(std::move(path)) {}

  // Takes what is new in the log. Throws std::system_error (EBADMSG: a record in the middle is damaged).
  void update();

  // An unknown name throws std::out_of_range with the names there are.
  v1::Statistics answer(const StatisticsQuery& query) const;
  std::vector<v1::SeriesInfo> series() const;  // and profiles, in the order of the case
  std::size_t bytes() const;                   // of memory, about

 private:
  struct Sample {
    std::uint64_t step = 0;
    double time = 0;  // s
    double value = 0;
  };
  struct Monitor {
    std::vector<Sample> samples;                    // steps ascend
    std::map<std::uint32_t, v1::BinClosed> closed;  // by bin
  };
  void take(const v1::StatisticsRecord& record);
  void take(std::uint64_t monitor, const Sample& sample);
  void reserve();
  void forget_after(std::uint64_t step);
  v1::Series series_of(std::size_t monitor, const StatisticsQuery& query) const;
  v1::Profile profile_of(std::size_t monitor) const;
  void note_newest(std::size_t monitor, v1::Statistics& statistics) const;

  static std::span<const Sample> within(const std::vector<Sample>& samples, const StatisticsQuery& query);
  static void put(std::span<const Sample> samples, v1::Series& series);
  static void put_thinned(std::span<const Sample> samples, std::size_t groups, v1::Series& series);

  std::filesystem::path path_;
  LogReader reader_;
  v1::Schema schema_;
  std::vector<Monitor> monitors_;
};

// One answer from a log. Throws what StatisticsLog throws.
v1::Statistics read_statistics(const std::filesystem::path& log, const StatisticsQuery& query);

// Throws std::out_of_range with the names there are, unless nothing is known yet or each name is a monitor's.
void check_names(const v1::Schema& schema, std::span<const std::string> names);

// Mean of the bin means and half of the 95 % interval t(0.975, N−1) s/√N; bins that are NaN are left out.
v1::Estimate estimate(std::span<const double> bin_means);

}  // namespace bedflow
