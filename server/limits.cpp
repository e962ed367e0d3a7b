// What bounds the jobs: quotas of owners and of all, and the reserve of the disk. And the jobs as numbers.
#include <limits>
#include <system_error>
#include <utility>

#include "jobs.h"
#include "refusal.h"
#include "size_text.h"

namespace bedflow::server {
namespace {

const char* const everybody = "all owners together";

// Ranks × wall time, s.
double rank_seconds(const v1::Job& job, std::int64_t until) {
  if (!job.has_attempt_unix_nanos() || until < job.attempt_unix_nanos()) return 0;
  return 1e-9 * static_cast<double>(until - job.attempt_unix_nanos()) * job.spec().ranks();
}

std::uint64_t free_bytes(const std::filesystem::path& folder) {
  std::error_code failed;
  const auto space = std::filesystem::space(folder, failed);
  return failed ? 0 : space.available;
}

}  // namespace

Holding Jobs::holding(const std::string& owner) const {
  Holding now;
  now.jobs = static_cast<std::uint64_t>(catalogue_.count_of(owner));
  const auto bytes = measured_.owner_bytes.find(owner);
  now.bytes = owner.empty() ? measured_.bytes : bytes == measured_.owner_bytes.end() ? 0 : bytes->second;
  return now;
}

std::uint64_t Jobs::running(const std::string& owner) const {
  std::uint64_t count = 0;
  for (const auto& [id, live] : live_) count += owner.empty() || live.record.job.owner() == owner ? 1 : 0;
  return count;
}

void Jobs::require_quota(const std::string& owner) const {
  if (!settings_.quotas.any()) return;
  require_room(settings_.quotas.of(owner), holding(owner), "owner " + owner);
  require_room(settings_.quotas.all(), holding(""), everybody);
}

std::string Jobs::why_not_start(const std::string& owner) const {
  if (settings_.disk_reserve > 0) {
    const auto free = free_bytes(settings_.data);
    if (free < settings_.disk_reserve)
      return "room on the disk: " + bytes_text(free) + " are free, and the reserve is " + bytes_text(settings_.disk_reserve);
  }
  if (!settings_.quotas.any()) return {};
  const auto why = why_not_run(settings_.quotas.of(owner), running(owner), "owner " + owner);
  return why.empty() ? why_not_run(settings_.quotas.all(), running(""), everybody) : why;
}

void Jobs::count_time(JobRecord& record, std::int64_t until) {
  record.job.set_rank_seconds(record.job.rank_seconds() + rank_seconds(record.job, until));
}

void Jobs::add_time_so_far(v1::Job& job) {
  job.set_rank_seconds(job.rank_seconds() + rank_seconds(job, now_nanos()));
}

Figures Jobs::figures() {
  Figures figures;
  figures.disk_free = free_bytes(settings_.data);
  figures.disk_reserve = settings_.disk_reserve;
  figures.slots = settings_.slots;
  const std::lock_guard guard(mutex_);
  figures.jobs = catalogue_.counts();
  figures.entered = entered_;
  figures.failures = failures_;
  for (const auto& [id, live] : live_) {
    figures.ranks_in_use += live.record.job.spec().ranks();
    figures.live.push_back(view(live.record));
  }
  return figures;
}

std::vector<v1::Job> Jobs::all() {
  constexpr std::int64_t page = 500;  // calls come in between
  std::vector<v1::Job> jobs;
  for (auto below = std::numeric_limits<std::int64_t>::max();;) {
    const std::lock_guard guard(mutex_);
    const auto records = catalogue_.page(below, {}, page);
    for (const auto& record : records) jobs.push_back(view(record));
    if (std::ssize(records) < page) return jobs;
    below = records.back().number;
  }
}

void Jobs::take_measured(MeasuredUse measured) {
  const std::lock_guard guard(mutex_);
  measured_ = std::move(measured);
}

void Jobs::add_limits(v1::Usage& usage) {
  const Figures now = figures();
  const auto count = [&](v1::JobState state) {
    const auto found = now.jobs.find(state);
    return found == now.jobs.end() ? 0U : static_cast<std::uint32_t>(found->second);
  };
  usage.set_disk_free_bytes(now.disk_free);
  usage.set_disk_reserve_bytes(now.disk_reserve);
  usage.set_jobs_pending(count(v1::PENDING) + count(v1::RECOVERING));
  usage.set_jobs_running(static_cast<std::uint32_t>(now.live.size()));
  usage.set_ranks_in_use(now.ranks_in_use);
  usage.set_slots(now.slots);
  if (!settings_.quotas.any()) return;
  *usage.mutable_quota() = settings_.quotas.all();
  for (auto& owner : *usage.mutable_owners()) *owner.mutable_quota() = settings_.quotas.of(owner.owner());
}

}  // namespace bedflow::server
