// What happens to the jobs by itself: attempts are followed to their end, waiting jobs start, what an earlier server has left is
// taken up.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <system_error>
#include <utility>
#include <vector>

#include "case_file.h"
#include "jobs.h"

namespace bedflow::server {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto patience = 200ms;         // between two looks when nothing is told
constexpr auto end_patience = 20ms;      // while an engine that has said its last word goes down
constexpr auto longest_end = 15s;        // that this may take
constexpr std::int64_t queue_look = 64;  // waiting jobs that are considered in one round

constexpr auto longest_pause = 60s;

// After a process that died the first retry comes at once; what may need a while to mend gets a second. The next come after 2, 4,
// 8 … 60 s.
std::chrono::seconds pause_before(std::uint32_t retry, v1::StopReason reason) {
  const bool mends_slowly = reason == v1::BACKEND_ERROR || reason == v1::NODE_LOST || reason == v1::HEARTBEAT_LOST;
  if (retry <= 1) return mends_slowly ? 1s : 0s;
  return std::min<std::chrono::seconds>(1s * (1 << std::min(retry - 1, 6U)), longest_pause);
}

// A clock that was set back must not make it wait for longer than any pause is.
bool is_due(const v1::Job& job) {
  const auto left = std::chrono::nanoseconds(job.next_attempt_unix_nanos() - now_nanos());
  return left <= 0s || left > longest_pause;
}

}  // namespace

Jobs::Jobs(Settings settings)
    : settings_(std::move(settings)),
      planner_(settings_.programs.engine),
      catalogue_(settings_.data / "catalogue.sqlite"),
      executor_(settings_.programs) {
  std::filesystem::create_directories(settings_.data / "jobs");
  std::filesystem::remove_all(settings_.data / "drafts");  // submissions that were never acknowledged
  std::filesystem::create_directories(settings_.data / "drafts");
  finish_removals();
  adopt();
}

void Jobs::adopt() {
  for (auto& record : catalogue_.in_states({v1::STARTING, v1::RUNNING, v1::SUSPENDING, v1::CANCELLING})) {
    const std::string id = record.job.id();
    const auto epoch = record.job.epoch();
    auto& live = live_.emplace(id, Live{std::move(record), Attempt(folder_of(id), epoch)}).first->second;
    live.adopted = true;
    notifier_.add(live.attempt.folder().events());
    live.attempt.look();
    live.repeat_command = !live.attempt.has_started();
    const bool alive = executor_.is_alive(live.attempt.folder(), epoch);
    spdlog::info("{} taken up in state {}; attempt {} {}", id, state_word(live.record.job.state()), epoch,
                 alive ? "runs" : "has ended");
  }
}

std::set<std::string> Jobs::advance() {
  bool ending = false;
  {
    const std::lock_guard guard(mutex_);
    for (const auto& [id, live] : live_) ending = ending || live.stopped_at;
  }
  notifier_.wait(ending ? end_patience : patience);
  std::unique_lock guard(mutex_);
  executor_.reap();
  for (auto entry = live_.begin(); entry != live_.end();) {
    Live& live = entry->second;
    const bool alive = executor_.is_alive(live.attempt.folder(), live.attempt.epoch());  // before the look: nothing comes after
    look_at(live);
    if (!alive) end(live);
    entry = is_attended(live.record.job.state()) ? std::next(entry) : live_.erase(entry);
  }
  while (auto next = next_to_start()) start(std::move(*next), guard);
  changed_.notify_all();
  return std::exchange(news_, {});
}

void Jobs::look_at(Live& live) {
  Attempt& attempt = live.attempt;
  const auto feed = feeds_.find(live.record.job.id());
  if (attempt.look(feed == feeds_.end() ? nullptr : feed->second.lock())) news_.insert(live.record.job.id());
  const auto state = live.record.job.state();
  if (attempt.has_started() && state == v1::STARTING) store(live.record, v1::RUNNING);
  if (attempt.has_started() && std::exchange(live.repeat_command, false)) {
    v1::Control last;
    read_message(attempt.folder().control(), last);
    if (state == v1::SUSPENDING) attempt.folder().command(v1::Control::SUSPEND);
    if (state == v1::CANCELLING) attempt.folder().command(v1::Control::CANCEL, live.skip_checkpoint || last.skip_checkpoint());
  }
  if (attempt.stopped() && !live.stopped_at) live.stopped_at = Clock::now();
  if (live.stopped_at && Clock::now() - *live.stopped_at > longest_end) executor_.kill(attempt.folder(), attempt.epoch());
  if (!attempt.stopped() && !live.start_failure && attempt.silence() > settings_.heartbeat_limit) {
    live.heartbeat_lost = true;
    executor_.kill(attempt.folder(), attempt.epoch());
  }
}

void Jobs::end(Live& live) {
  const Attempt& attempt = live.attempt;
  const JobFolder& folder = attempt.folder();
  JobRecord changed = live.record;
  Ending ending = live.start_failure ? *live.start_failure : attempt.ending();
  if (!attempt.stopped() && live.heartbeat_lost) {
    ending = {v1::HEARTBEAT_LOST, "no sign of life for " + std::to_string(settings_.heartbeat_limit.count()) + " s"};
  }
  // A server that died between its commit and the start of the runner: nobody's fault.
  const bool never_began = live.adopted && !std::filesystem::exists(folder.runner(attempt.epoch()));
  if (attempt.has_started()) changed.from_step.reset();  // the checkpoint was good; from now on the newest is
  if (attempt.has_gone_on()) changed.retries = 0;        // a week has many faults; each brings the job further
  count_time(changed, attempt.ended_unix_nanos());
  if (ending.reason >= v1::INVALID_CASE) ++failures_[ending.reason];
  store_end(changed, ending, never_began);
  live.record = changed;
  notifier_.remove(folder.events());
}

void Jobs::store_end(JobRecord& record, Ending ending, bool is_nobodys_fault) {
  const bool may_retry = is_nobodys_fault || record.retries < record.job.spec().retries().most();
  const auto next = after_attempt(record.job.state(), ending.reason, may_retry);
  if (next == v1::RECOVERING && !is_nobodys_fault) {
    const auto pause = pause_before(++record.retries, ending.reason);
    record.job.set_next_attempt_unix_nanos(now_nanos() + std::chrono::nanoseconds(pause).count());
    if (pause > 0s) ending.message += "; tried again in " + std::to_string(pause.count()) + " s";
  }
  store(record, next, ending);
}

// The oldest waiting job that is due, if its ranks fit into the free slots.
std::optional<JobRecord> Jobs::next_to_start() {
  std::uint32_t used = 0;
  for (const auto& [id, live] : live_) used += live.record.job.spec().ranks();
  for (auto& record : catalogue_.in_states({v1::PENDING, v1::RECOVERING}, queue_look)) {
    if (!is_due(record.job)) continue;
    if (auto why = why_not_start(record.job); !why.empty()) {
      waits_for_[record.job.id()] = std::move(why);
      continue;
    }
    if (used + record.job.spec().ranks() > settings_.slots) return std::nullopt;
    return std::move(record);
  }
  return std::nullopt;
}

// Calls go on while the folder is written and the runner started; that takes many writes to the disk.
void Jobs::start(JobRecord record, std::unique_lock<std::mutex>& guard) {
  const std::string id = record.job.id();
  const auto folder = folder_of(id);
  const auto epochs = folder.epochs();  // a folder restored from a backup may be ahead of the catalogue
  const auto epoch = std::max(record.job.epoch(), epochs.empty() ? 0 : epochs.back()) + 1;
  record.job.set_epoch(epoch);
  record.job.set_attempt_unix_nanos(now_nanos());
  waits_for_.erase(id);
  // Committed before it happens: whatever dies now, no other attempt has this epoch.
  store(record, v1::STARTING);
  auto& live = live_.emplace(id, Live{std::move(record), Attempt(folder, epoch)}).first->second;  // only this thread erases it
  live.attempt.look();
  live.repeat_command = true;
  try {
    std::filesystem::remove(folder.control());  // commands to the attempt before are over
    const std::string text = std::filesystem::exists(folder.case_file()) ? "" : case_text(case_of(live.record));
    const v1::JobSpec spec = live.record.job.spec();
    const auto from_step = live.record.from_step;
    guard.unlock();
    lay_out(id, text, spec);
    executor_.start(folder, epoch, spec.ranks(), from_step);
    guard.lock();
    notifier_.add(folder.events());
  } catch (const std::exception& failure) {
    if (!guard.owns_lock()) guard.lock();
    spdlog::error("{} cannot be started: {}", id, failure.what());
    const auto* system = dynamic_cast<const std::system_error*>(&failure);
    const bool is_full = system && system->code() == std::errc::no_space_on_device;
    live.start_failure = {is_full ? v1::DISK_FULL : v1::BACKEND_ERROR, failure.what()};
    notifier_.poke();  // the next round ends it
  }
}

}  // namespace bedflow::server
