// statistics.log of a job folder -> series, profiles and their confidence. Used by the server's queries and the client.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bedflow/v1/results.pb.h"

namespace bedflow {

struct StatisticsQuery {
  std::vector<std::string> names;            // all if empty
  std::optional<double> from_time, to_time;  // s; of the samples of series
  std::uint32_t most = 0;  // thin a series to at most so many samples, keeping each group's minimum and maximum; 0: all
};

// Steps that were run again after a resume replace the earlier ones. An unknown name throws std::out_of_range with the names
// there are.
v1::Statistics read_statistics(const std::filesystem::path& log, const StatisticsQuery& query);

// Mean of the bin means and half of the 95 % interval t(0.975, N−1) s/√N; bins that are NaN are left out.
v1::Estimate estimate(std::span<const double> bin_means);

}  // namespace bedflow
