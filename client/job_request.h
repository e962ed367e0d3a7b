// What `submit` and `run` ask of a new job.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bedflow/v1/service.pb.h"
#include "connection.h"

namespace bedflow::client {

struct JobOptions {
  std::string where;
  std::vector<std::string> set;
  std::optional<double> end;               // s
  std::optional<std::uint32_t> ranks;      // 1 if absent
  std::optional<double> checkpoint_every;  // simulated s
  std::optional<std::uint64_t> checkpoint_steps;
  std::optional<std::uint32_t> keep, keep_every;  // checkpoints
  std::optional<double> keep_every_time;          // simulated s
  std::optional<double> checkpoint_wall;          // s
  std::string when_disk_full;                     // "suspend" or "go-on"; empty: the server's default
  std::string checkpoint_writers;                 // "automatic", "every-rank" or "one-rank"; empty: the server's default
  std::optional<std::uint32_t> retries;
  std::optional<double> wall_limit;  // s
  std::string at_wall_limit;         // "end" or "requeue"; empty: the server's default
  std::string executor;              // the server's default if empty
  std::optional<int> priority;
  std::vector<std::string> labels;  // name=value
};

void add_job_options(CLI::App* verb, JobOptions& options);
// --wall-limit: seconds, or a number with s, min, h or d.
void add_wall_limit(CLI::App* verb, std::optional<double>& seconds);
CLI::Option* add_priority(CLI::App* verb, std::optional<int>& priority);

// With a random request id, so that the call may be repeated. Throws Failure when the case has faults.
v1::CreateJobRequest create_request(const JobOptions& options);

std::string new_request_id();

// NAME=VALUE each. Throws Failure.
void set_labels(v1::JobSpec& spec, const std::vector<std::string>& labels);

// JOB or JOB@STEP. Throws Failure.
v1::CheckpointName checkpoint_name(const std::string& text);

// Repeats a call whose answer was lost: the request id makes that harmless.
v1::CreateJobResponse create_job(const Connection& connection, const v1::CreateJobRequest& request);

}  // namespace bedflow::client
