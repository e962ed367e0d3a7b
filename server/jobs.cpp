// What clients ask of the jobs that there are. See create.cpp for how they come, supervise.cpp for what happens by itself.
#include "jobs.h"

#include <spdlog/spdlog.h>

#include <charconv>
#include <limits>
#include <system_error>
#include <utility>
#include <vector>

#include "case_file.h"
#include "refusal.h"
#include "security.h"
#include "submission.h"

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

void require_job_id(const std::string& id) {
  if (!is_job_id(id))
    throw Refusal(Refused::bad_request, "'" + printable(id) + "' is not a job's id (j- and 12 hex digits)", "bedflow list");
}

std::string steps_text(const std::vector<std::uint64_t>& steps) {
  std::string text;
  for (const auto step : steps) text += (text.empty() ? "" : ", ") + std::to_string(step);
  return text.empty() ? "it has none" : "it has those of step " + text;
}

}  // namespace

std::uint64_t existing_step(const JobFolder& folder, const std::string& id, std::optional<std::uint64_t> wanted) {
  const auto steps = folder.checkpoint_steps();
  for (const auto step : steps) {
    if (!wanted || step == *wanted) return step;
  }
  throw Refusal(
      Refused::checkpoint_not_found,
      "job " + id + " has no checkpoint" + (wanted ? " of step " + std::to_string(*wanted) + "; " + steps_text(steps) : ""),
      "bedflow checkpoint list " + id);
}

JobRecord Jobs::record_of(const std::string& id) const {
  require_job_id(id);
  if (const auto live = live_.find(id); live != live_.end()) return live->second.record;
  if (auto record = catalogue_.find(id)) return *record;
  throw Refusal(Refused::job_not_found, "there is no job " + id, "bedflow list");
}

JobRecord Jobs::own_record(const Caller& caller, const std::string& id) const {
  JobRecord record = record_of(id);
  if (caller.may_act_on(record.job.owner())) return record;
  throw Refusal(Refused::not_owner,
                "job " + id + " is " + record.job.owner() + "'s; " + caller.owner + " may look at it, but not act on it",
                "bedflow list --owner " + caller.owner);
}

v1::Job Jobs::view(const JobRecord& record) const {
  v1::Job job = record.job;
  job.set_folder(folder_of(job.id()).root());
  job.set_retries(record.retries);
  if (const auto live = live_.find(job.id()); live != live_.end()) {
    add_time_so_far(job);
    if (const auto memory = measured_.memory.find(job.id()); memory != measured_.memory.end())
      job.set_memory_bytes(memory->second);
    const Attempt& attempt = live->second.attempt;
    if (attempt.progress().ByteSizeLong() > 0) *job.mutable_progress() = attempt.progress();
    job.set_last_sequence(attempt.last_sequence());
  }
  if (auto why = waits_for(record); !why.empty()) job.set_waits_for(std::move(why));
  return job;
}

std::shared_ptr<Feed> Jobs::feed_of(const v1::Job& job) {
  std::erase_if(feeds_, [](const auto& entry) { return entry.second.expired(); });
  auto& weak = feeds_[job.id()];
  auto feed = weak.lock();
  if (!feed) weak = feed = std::make_shared<Feed>(job.last_sequence());
  return feed;
}

void Jobs::store(JobRecord& record, v1::JobState state, std::optional<Ending> why) {
  JobRecord changed = record;
  changed.job = view(record);
  changed.job.clear_folder();
  changed.job.clear_waits_for();
  changed.job.clear_memory_bytes();
  changed.job.set_rank_seconds(record.job.rank_seconds());  // without that of the attempt that runs
  if (state != v1::RECOVERING) changed.job.clear_next_attempt_unix_nanos();
  changed.job.set_state(state);
  changed.job.set_changed_unix_nanos(now_nanos());
  changed.job.clear_reason();
  changed.job.clear_message();
  if (why) {
    changed.job.set_reason(why->reason);
    changed.job.set_message(why->message);
  }
  catalogue_.update(changed);
  record = changed;
  ++entered_[state];
  if (is_waiting(state)) {
    queue_.put(record);
  } else {
    queue_.take(record.job.id());
  }
  spdlog::info("{} is {}{}", record.job.id(), state_word(state), why ? ": " + why->message : "");
  if (const auto watched = feeds_.find(record.job.id()); watched != feeds_.end()) {
    if (const auto feed = watched->second.lock()) {
      feed->add(view(record));
      told_[record.job.id()] = {waits_for(record), std::chrono::steady_clock::now()};
    }
  }
  news_.insert(record.job.id());
  changed_.notify_all();
  notifier_.poke();
}

// ---------------------------------------------------------------------------------------------------- requests

v1::Job Jobs::get(const std::string& id) {
  const std::lock_guard guard(mutex_);
  return with_pins(record_of(id));
}

v1::ListJobsResponse Jobs::list(const v1::ListJobsRequest& request) {
  const std::size_t size = request.has_page_size() ? request.page_size() : 50;
  if (size < 1 || size > 1000)
    throw Refusal(Refused::bad_request, "page_size is " + std::to_string(size) + "; allowed are 1 to 1000");
  std::int64_t below = std::numeric_limits<std::int64_t>::max();
  const std::string& token = request.page_token();
  const auto [stop, error] = std::from_chars(token.data(), token.data() + token.size(), below);
  if (!token.empty() && (error != std::errc() || stop != token.data() + token.size() || below < 1)) {
    throw Refusal(Refused::bad_request, "page_token '" + printable(token) + "' is none that this server gave");
  }
  std::vector<v1::JobState> states;
  for (const int state : request.states()) states.push_back(static_cast<v1::JobState>(state));
  const auto has_labels = [&](const v1::Job& job) {
    for (const auto& [key, value] : request.labels()) {
      const auto label = job.spec().labels().find(key);
      if (label == job.spec().labels().end() || label->second != value) return false;
    }
    return true;
  };
  const std::lock_guard guard(mutex_);
  v1::ListJobsResponse response;
  while (true) {
    const auto page = catalogue_.page(below, states, static_cast<std::int64_t>(size) + 1, request.owner());
    for (const auto& record : page) {
      if (static_cast<std::size_t>(response.jobs_size()) == size) {
        response.set_next_page_token(std::to_string(below));
        return response;
      }
      below = record.number;
      if (has_labels(record.job)) *response.add_jobs() = view(record);
    }
    if (page.size() <= size) return response;
  }
}

JobRecord& Jobs::require(JobRecord& record, Request request, const char* wanted) const {
  if (after_request(record.job.state(), request) != v1::STATE_UNKNOWN) return record;
  const std::string& id = record.job.id();
  const bool may_start_again = request == Request::resume && is_final(record.job.state());
  throw Refusal(Refused::wrong_state, "job " + id + " is " + state_word(record.job.state()) + " and cannot be " + wanted,
                may_start_again ? "bedflow submit --from " + id : "bedflow get " + id);
}

v1::Job Jobs::request(const Caller& caller, const std::string& id, Request request, const char* wanted,
                      v1::Control::Command command, bool skip_checkpoint) {
  const std::lock_guard guard(mutex_);
  JobRecord found = own_record(caller, id);
  require(found, request, wanted);
  const auto live = live_.find(id);
  JobRecord& record = live == live_.end() ? found : live->second.record;
  const auto next = after_request(record.job.state(), request);
  if (next == record.job.state()) return view(record);
  if (live != live_.end()) {
    live->second.skip_checkpoint = skip_checkpoint;
    const JobFolder& folder = live->second.attempt.folder();
    if (fs::exists(folder.root())) folder.command(command, skip_checkpoint);
  }
  store(record, next);
  return view(record);
}

v1::Job Jobs::cancel(const Caller& caller, const std::string& id, bool skip_checkpoint) {
  return request(caller, id, Request::cancel, "cancelled", v1::Control::CANCEL, skip_checkpoint);
}

v1::Job Jobs::suspend(const Caller& caller, const std::string& id) {
  return request(caller, id, Request::suspend, "suspended", v1::Control::SUSPEND, false);
}

// The record with what the request changes. Throws Refusal(invalid_case).
JobRecord Jobs::changed_by(const v1::ResumeJobRequest& request, JobRecord record) const {
  auto& spec = *record.job.mutable_spec();
  if (request.ranks() > 0) spec.set_ranks(request.ranks());
  if (request.has_wall_limit_seconds()) spec.set_wall_limit_seconds(request.wall_limit_seconds());
  if (request.has_priority()) spec.set_priority(request.priority());
  if (auto faults = check_spec(spec, capacities()); !faults.empty())
    throw Refusal(Refused::invalid_case, "job " + request.id() + " cannot be resumed so", "bedflow server info",
                  std::move(faults));
  return record;
}

v1::Job Jobs::resume(const Caller& caller, const v1::ResumeJobRequest& request) {
  std::optional<v1::PlanReport> plan;  // on other ranks another one; made without the lock
  if (request.ranks() > 0) {
    std::string text;
    {
      const std::lock_guard guard(mutex_);
      JobRecord found = own_record(caller, request.id());
      changed_by(request, require(found, Request::resume, "resumed"));
      text = case_text(case_of(found));
    }
    plan = planner_.plan(text, request.ranks());
  }
  const std::lock_guard guard(mutex_);
  JobRecord record = own_record(caller, request.id());
  record = changed_by(request, require(record, Request::resume, "resumed"));
  if (plan) keep_plan(record.job, *plan);
  const auto folder = folder_of(request.id());
  if (request.has_step()) {
    record.from_step = existing_step(folder, request.id(), request.step());
    // What is newer belongs to a history that the user has left: a later retry must not fall back to it.
    for (const auto step : folder.checkpoint_steps()) {
      const auto path = folder.checkpoint(step).string();
      if (step > request.step()) fs::rename(path, path + ".superseded-" + std::to_string(record.job.epoch()));
    }
  }
  record.retries = 0;
  store(record, v1::PENDING);
  return view(record);
}

v1::Checkpoint Jobs::create_checkpoint(const Caller& caller, const std::string& id, std::chrono::duration<double> limit) {
  std::unique_lock guard(mutex_);
  JobRecord record = own_record(caller, id);
  require(record, Request::checkpoint, "asked for a checkpoint");
  const auto before = live_.at(id).attempt.last_sequence();
  live_.at(id).attempt.folder().command(v1::Control::CHECKPOINT);
  const auto live = [&] { return live_.find(id); };
  const bool answered = changed_.wait_for(guard, limit, [&] {
    return stopping_ || live() == live_.end() || live()->second.attempt.checkpoint().sequence() > before;
  });
  if (stopping_) throw Refusal(Refused::going_down, "the server goes down; the checkpoint will still be written");
  if (!answered) {
    throw Refusal(Refused::timed_out, "no checkpoint of " + id + " within the time given; it will come with the next step",
                  "bedflow checkpoint list " + id);
  }
  if (live() == live_.end()) {
    throw Refusal(Refused::wrong_state, "job " + id + " ended before it wrote the checkpoint", "bedflow checkpoint list " + id);
  }
  const auto& written = live()->second.attempt.checkpoint().checkpoint();
  v1::Checkpoint checkpoint;
  checkpoint.set_job(id);
  checkpoint.set_step(written.step());
  checkpoint.set_time(written.time());
  checkpoint.set_bytes(written.bytes());
  checkpoint.set_file(written.file());
  return checkpoint;
}

// -------------------------------------------------------------------------------------------------------- views

JobFolder Jobs::folder(const std::string& id) {
  const std::lock_guard guard(mutex_);
  record_of(id);
  return folder_of(id);
}

Cursor Jobs::watch(const std::string& id, std::uint64_t after, bool from_now) {
  const std::lock_guard guard(mutex_);
  const v1::Job job = view(record_of(id));
  if (after > job.last_sequence()) {
    throw Refusal(Refused::bad_request, "after_sequence is " + std::to_string(after) + "; the newest event of " + id + " is " +
                                            std::to_string(job.last_sequence()));
  }
  told_.try_emplace(id, Told{job.waits_for(), std::chrono::steady_clock::now()});
  return {folder_of(id).events(), job, feed_of(job), from_now ? job.last_sequence() : after};
}

v1::ServerInfo Jobs::info() {
  v1::ServerInfo info;
  info.set_version(BEDFLOW_VERSION);
  info.set_slots(settings_.slots);
  std::error_code failed;
  if (const auto space = fs::space(settings_.data, failed); !failed) info.set_disk_free_bytes(space.available);
  for (auto& law : built_laws()) info.add_built_laws(std::move(law));
  const std::lock_guard guard(mutex_);
  info.set_ranks_in_use(uses()["local"].ranks);
  info.set_jobs_running(static_cast<std::uint32_t>(live_.size()));
  info.set_jobs_pending(static_cast<std::uint32_t>(queue_.size()));
  add_queue(info);
  return info;
}

bool Jobs::is_idle() {
  const std::lock_guard guard(mutex_);
  return live_.empty() && queue_.size() == 0;
}

void Jobs::stop_waiting() {
  const std::lock_guard guard(mutex_);
  stopping_ = true;
  changed_.notify_all();
}

}  // namespace bedflow::server
