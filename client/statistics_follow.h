// Samples of a job's series as they come, over a stream that may break: taken up behind the last record, nothing twice.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "connection.h"
#include "table.h"

namespace bedflow::client {

struct FollowPlan {
  std::vector<std::string> names;                   // all if empty
  std::optional<double> from_time, to_time;         // s; of the samples that are printed
  std::optional<std::uint64_t> from_step, to_step;  // of the same
  double away_seconds = 120;                        // how long a server may be away
};

// Prints each sample on a line until the job has ended. Throws Failure.
void follow_statistics(const Connection& connection, const std::string& id, const FollowPlan& plan, Format format);

}  // namespace bedflow::client
