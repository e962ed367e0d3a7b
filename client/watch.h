// Following a job's events over a stream that may break: resumed from the last sequence number seen, nothing twice, nothing
// missed.
#pragma once

#include <functional>
#include <optional>

#include "connection.h"
#include "interrupt.h"

namespace bedflow::client {

struct WatchPlan {
  std::uint64_t after_sequence = 0;  // 0 replays all
  bool from_now = false;
  bool until_caught_up = false;             // end with the newest event there is, not with the job
  std::optional<v1::JobState> until_state;  // end when the job is in this state too
  double away_seconds = 120;                // how long a server may be away; wall s
  std::optional<double> timeout_seconds;    // of the whole watch
};

enum class WatchEnd { job_final, state_reached, caught_up, interrupted, timed_out };

struct WatchResult {
  WatchEnd end;
  v1::Job job;             // the newest that was told
  std::uint64_t sequence;  // resume token
};

struct WatchCalls {
  std::function<void(const v1::WatchJobResponse&)> take = [](const v1::WatchJobResponse&) {};
  std::function<void(const std::string&)> note = [](const std::string&) {};  // connection lost, back again
  std::function<void()> lost = [] {};  // before each try to connect again; may bring the server back
};

// Throws Failure when the server refuses (no such job), or stays away too long.
WatchResult watch_job(const Connection& connection, const std::string& id, const WatchPlan& plan, const WatchCalls& calls,
                      Interrupt& interrupt);

}  // namespace bedflow::client
