// The queue as the jobs see it: what the executors have, what runs there, what the next job lacks, and who is told.
#include "jobs.h"
#include "slurm_executor.h"

namespace bedflow::server {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 2s;           // between two reasons to wait that a watcher is told
constexpr std::size_t most_shown = 20;  // waiting jobs in the server's info

}  // namespace

Capacities Jobs::capacities() const {
  Capacities all = {{"local", {settings_.slots, settings_.slots, settings_.memory_bytes}}};
  if (settings_.slurm) all["slurm"] = {0, settings_.slurm->most_ranks, 0};
  return all;
}

std::map<std::string, Use> Jobs::uses() const {
  std::map<std::string, Use> uses;
  for (const auto& [id, live] : live_) {
    const auto& job = live.record.job;
    Use& use = uses[job.spec().executor()];
    use.ranks += job.spec().ranks();
    use.memory_bytes += static_cast<double>(job.planned_memory_bytes());
    ++use.jobs;
  }
  return uses;
}

std::string Jobs::waits_for(const JobRecord& record) const {
  if (const auto live = live_.find(record.job.id()); live != live_.end()) return live->second.waits_for;
  if (!is_waiting(record.job.state())) return {};
  auto held = why_not_start(record.job.owner());
  return held.empty() ? queue_.reason(record.job.id(), uses(), is_held()) : held;
}

// Each owner is asked about once.
IsHeld Jobs::is_held() const {
  return [this, held = std::make_shared<std::map<std::string, bool>>()](const std::string& owner) {
    const auto [known, is_new] = held->try_emplace(owner);
    if (is_new) known->second = !why_not_start(owner).empty();
    return known->second;
  };
}

// Watchers hear when a waiting job's reason has changed; not at every step of the queue.
void Jobs::tell_waiting() {
  for (const auto& [id, weak] : feeds_) {
    const auto feed = weak.lock();
    if (!feed) continue;
    const auto live = live_.find(id);
    const auto waiting = live == live_.end() && queue_.has(id) ? catalogue_.find(id) : std::nullopt;
    if (live == live_.end() && !waiting) {
      told_.erase(id);
      continue;
    }
    const JobRecord& record = waiting ? *waiting : live->second.record;
    const auto now = std::chrono::steady_clock::now();
    auto& [told, at] = told_[id];
    auto why = waits_for(record);
    if (why == told || now - at < patience) continue;
    told = std::move(why);
    at = now;
    feed->add(view(record));
    news_.insert(id);
  }
  std::erase_if(told_, [&](const auto& entry) { return !feeds_.contains(entry.first); });
}

void Jobs::add_queue(v1::ServerInfo& info) {
  const auto uses = this->uses();
  for (const auto& [name, capacity] : capacities()) {
    const auto found = uses.find(name);
    const Use use = found == uses.end() ? Use() : found->second;
    auto& executor = *info.add_executor_infos();
    info.add_executors(name);
    executor.set_name(name);
    executor.set_slots(capacity.most_ranks);
    executor.set_ranks_in_use(use.ranks);
    if (capacity.memory_bytes > 0) {
      executor.set_memory_bytes(static_cast<std::uint64_t>(capacity.memory_bytes));
      executor.set_memory_in_use(static_cast<std::uint64_t>(use.memory_bytes));
    }
    std::uint32_t queued = 0;
    for (const auto& [id, live] : live_) queued += live.record.job.spec().executor() == name && !live.waits_for.empty() ? 1 : 0;
    executor.set_jobs_running(use.jobs - queued);
    executor.set_jobs_queued(queued);
    executor.set_jobs_pending(queue_.size_of(name));
    if (auto* slurm = dynamic_cast<SlurmExecutor*>(executors_.at(name).get())) {
      if (auto trouble = slurm->trouble(); !trouble.empty()) executor.set_trouble(std::move(trouble));
    }
  }
  for (const auto& id : queue_.first(most_shown)) {
    const auto record = catalogue_.find(id);
    if (!record) continue;
    auto& job = *info.add_queue();
    job.set_id(id);
    job.set_case_name(record->job.case_name());
    job.set_priority(record->job.spec().priority());
    job.set_ranks(record->job.spec().ranks());
    job.set_executor(record->job.spec().executor());
    job.set_waits_for(waits_for(*record));
  }
}

}  // namespace bedflow::server
