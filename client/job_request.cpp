#include "job_request.h"

#include <chrono>
#include <random>
#include <thread>

#include "case_source.h"
#include "terminal.h"

namespace bedflow::client {

std::string new_request_id() {
  std::random_device device;
  std::string id;
  for (int i = 0; i < 32; ++i) id += "0123456789abcdef"[device() % 16];
  return id;
}

void set_labels(v1::JobSpec& spec, const std::vector<std::string>& labels) {
  for (const auto& label : labels) {
    const auto equals = label.find('=');
    if (equals == label.npos || equals == 0) throw Failure(Exit::usage, "--label " + label + ": not of the form NAME=VALUE");
    (*spec.mutable_labels())[label.substr(0, equals)] = label.substr(equals + 1);
  }
}

v1::CheckpointName checkpoint_name(const std::string& text) {
  v1::CheckpointName name;
  const auto at = text.find('@');
  name.set_job(text.substr(0, at));
  if (at == text.npos) return name;
  const auto step = text.substr(at + 1);
  if (step.empty() || step.size() > 18 || step.find_first_not_of("0123456789") != step.npos) {
    throw Failure(Exit::usage, text + ": the step after @ is not a number", "bedflow checkpoint list " + name.job());
  }
  name.set_step(std::stoull(step));
  return name;
}

CLI::Option* add_time(CLI::App* verb, const char* name, std::optional<double>& seconds, const char* meaning) {
  const auto read = [name, &seconds](const std::string& text) {
    seconds = seconds_of_text(text);
    if (!seconds) throw CLI::ValidationError(name, text + " is no time; say e.g. 90 (seconds), 30min, 2h or 1.5d");
  };
  return verb->add_option_function<std::string>(name, read, meaning)->type_name("TIME");
}

void add_wall_limit(CLI::App* verb, std::optional<double>& seconds) {
  add_time(verb, "--wall-limit", seconds, "stop at a checkpoint after so much wall time of an attempt: 90 (s), 30min, 2h, 1d");
}

CLI::Option* add_priority(CLI::App* verb, std::optional<int>& priority) {
  return verb->add_option("--priority", priority, "-1000 to 1000: the highest starts first, the oldest among equals")
      ->check(CLI::Range(-1000, 1000))
      ->default_str("0");
}

void add_job_options(CLI::App* verb, JobOptions& options) {
  verb->add_option("--set", options.set, "change a parameter, as in time.end=2")->type_name("PATH=VALUE");
  verb->add_option("--end", options.end, "simulated time at which to end, s")->check(CLI::PositiveNumber);
  verb->add_option("--ranks", options.ranks, "MPI ranks")->check(CLI::Range(1, 100000))->default_str("1");
  verb->add_option("--checkpoint-every", options.checkpoint_every, "simulated time between checkpoints, s")
      ->check(CLI::PositiveNumber);
  verb->add_option("--checkpoint-steps", options.checkpoint_steps, "steps between checkpoints")->check(CLI::PositiveNumber);
  add_time(verb, "--checkpoint-wall", options.checkpoint_wall, "wall time between checkpoints: 90 (s), 30min, 2h")
      ->default_str("10min");
  verb->add_option("--keep", options.keep, "so many of the newest checkpoints stay")
      ->check(CLI::Range(2, 1000000))
      ->default_str("2");
  verb->add_option("--keep-every", options.keep_every, "and of the older ones every N-th")->check(CLI::PositiveNumber);
  verb->add_option("--keep-every-time", options.keep_every_time, "and the first in each such span of simulated time, s")
      ->check(CLI::PositiveNumber);
  verb->add_option("--when-disk-full", options.when_disk_full,
                   "suspend at the newest checkpoint, or go-on without new ones and try again; older ones stay in any case")
      ->check(CLI::IsMember({"suspend", "go-on"}))
      ->default_str("suspend");
  verb->add_option("--checkpoint-writers", options.checkpoint_writers,
                   "every-rank writes its own part; one-rank writes for all, as network disks under several machines need it")
      ->check(CLI::IsMember({"automatic", "every-rank", "one-rank"}))
      ->default_str("automatic");
  verb->add_option("--retries", options.retries, "after failures that are not the case's")
      ->check(CLI::Range(0, 100))
      ->default_str("2");
  add_wall_limit(verb, options.wall_limit);
  verb->add_option("--at-wall-limit", options.at_wall_limit,
                   "end there, to be resumed, or requeue: wait for its turn again and go on; at a checkpoint in any case")
      ->check(CLI::IsMember({"end", "requeue"}))
      ->default_str("end");
  verb->add_option("--label", options.labels, "label to find the job by")->type_name("NAME=VALUE");
}

v1::CreateJobRequest create_request(const JobOptions& options) {
  v1::CreateJobRequest request;
  request.set_request_id(new_request_id());
  if (!options.where.empty()) {
    auto set = options.set;
    if (options.end) set.push_back("time.end=" + CLI::detail::to_string(*options.end));
    *request.mutable_case_() = load_case(options.where, set);
  }
  auto& spec = *request.mutable_spec();
  spec.set_ranks(options.ranks.value_or(1));
  if (options.checkpoint_every) spec.mutable_checkpoints()->set_every_simulated_seconds(*options.checkpoint_every);
  if (options.checkpoint_steps) spec.mutable_checkpoints()->set_every_steps(*options.checkpoint_steps);
  if (options.keep) spec.mutable_checkpoints()->set_keep(*options.keep);
  if (options.keep_every) spec.mutable_checkpoints()->set_keep_every_nth(*options.keep_every);
  if (options.keep_every_time) spec.mutable_checkpoints()->set_keep_every_simulated_seconds(*options.keep_every_time);
  if (options.checkpoint_wall) spec.mutable_checkpoints()->set_every_wall_seconds(*options.checkpoint_wall);
  if (options.when_disk_full == "go-on") spec.mutable_checkpoints()->set_when_disk_full(v1::CheckpointPolicy::GO_ON);
  if (options.checkpoint_writers == "one-rank") spec.mutable_checkpoints()->set_writers(v1::CheckpointPolicy::ONE_RANK);
  if (options.checkpoint_writers == "every-rank") spec.mutable_checkpoints()->set_writers(v1::CheckpointPolicy::EVERY_RANK);
  if (options.retries) spec.mutable_retries()->set_most(*options.retries);
  if (options.wall_limit) spec.set_wall_limit_seconds(*options.wall_limit);
  if (options.at_wall_limit == "requeue") spec.set_at_wall_limit(v1::JobSpec::REQUEUE);
  if (!options.executor.empty()) spec.set_executor(options.executor);
  if (options.priority) spec.set_priority(*options.priority);
  set_labels(spec, options.labels);
  return request;
}

v1::CreateJobResponse create_job(const Connection& connection, const v1::CreateJobRequest& request) {
  constexpr int most = 5;
  for (int attempt = 1;; ++attempt) {
    try {
      return connection.call(&Stub::CreateJob, request, 60);
    } catch (const Failure& failure) {
      const bool lost = failure.code == Exit::unreachable || failure.code == Exit::timed_out;
      if (!lost || attempt == most) throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200 * attempt));
  }
}

}  // namespace bedflow::client
