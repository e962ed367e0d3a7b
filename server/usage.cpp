#include "usage.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <system_error>

#include "process.h"

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto longest_known = 10min;  // a folder that seems unchanged is looked at again

// Resident memory of a job's newest attempt on this machine.
std::uint64_t memory_of(const JobFolder& folder, std::uint32_t epoch) {
  v1::Runner runner;
  if (!read_message(folder.runner(epoch), runner) || runner.host() != host_name()) return 0;
  static const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  std::uint64_t bytes = 0;
  for (const pid_t process : session_members(static_cast<pid_t>(runner.pid()))) {
    std::uint64_t whole = 0, resident = 0;
    if (std::ifstream("/proc/" + std::to_string(process) + "/statm") >> whole >> resident) bytes += resident * page;
  }
  return bytes;
}

v1::JobUsage job_usage(const v1::Job& job, const FolderUse& use) {
  v1::JobUsage usage;
  usage.set_id(job.id());
  usage.set_owner(job.owner());
  usage.set_case_name(job.case_name());
  usage.set_state(job.state());
  usage.set_bytes(use.bytes);
  usage.set_checkpoint_bytes(use.checkpoint_bytes);
  usage.set_checkpoints(use.checkpoints);
  usage.set_rank_seconds(job.rank_seconds());
  if (job.has_memory_bytes()) usage.set_memory_bytes(job.memory_bytes());
  if (job.pinned()) usage.set_pinned(true);
  return usage;
}

void add_to_owner(v1::OwnerUsage& owner, const v1::JobUsage& job) {
  owner.set_owner(job.owner());
  owner.set_jobs(owner.jobs() + 1);
  owner.set_running(owner.running() + (is_attended(job.state()) ? 1 : 0));
  owner.set_bytes(owner.bytes() + job.bytes());
  owner.set_rank_seconds(owner.rank_seconds() + job.rank_seconds());
  owner.set_memory_bytes(owner.memory_bytes() + job.memory_bytes());
}

}  // namespace

FolderUse folder_use(const fs::path& folder) {
  FolderUse use;
  std::set<std::uint64_t> seen;
  std::error_code gone;
  for (auto entry = fs::recursive_directory_iterator(folder, gone); !gone && entry != fs::recursive_directory_iterator();
       entry.increment(gone)) {
    struct stat status {};
    if (::lstat(entry->path().c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    const auto bytes = static_cast<std::uint64_t>(status.st_size);
    if (status.st_nlink > 1) {
      if (!seen.insert(status.st_ino).second) continue;
      use.shared.emplace_back(status.st_ino, bytes);
    }
    use.bytes += bytes;
    const std::string name = entry->path().filename();
    if (!name.starts_with("checkpoint_") || name.ends_with(".kept")) continue;
    use.checkpoint_bytes += bytes;
    ++use.checkpoints;
  }
  return use;
}

const FolderUse& UsageBook::known_use(const v1::Job& job, Clock::time_point now) {
  Known& known = known_[job.id()];
  const bool is_new = known.changed != job.changed_unix_nanos() || known.sequence != job.last_sequence();
  if (is_new || is_attended(job.state()) || now - known.looked > longest_known)
    known = {job.changed_unix_nanos(), job.last_sequence(), now, folder_use(JobFolder(job.folder()).root())};
  return known.use;
}

std::vector<v1::Job> UsageBook::look() {
  const std::lock_guard looking(looking_);
  const auto now = Clock::now();
  auto jobs = jobs_.all();
  v1::Usage usage;
  std::map<std::string, v1::OwnerUsage> owners;
  std::map<std::uint64_t, int> names;  // of shared files, a job
  std::uint64_t counted_twice = 0;
  MeasuredUse measured;
  for (auto& job : jobs) {
    const FolderUse& use = known_use(job, now);
    if (is_attended(job.state())) {
      job.set_memory_bytes(memory_of(JobFolder(job.folder()), job.epoch()));
      measured.memory[job.id()] = job.memory_bytes();
    }
    for (const auto& [inode, bytes] : use.shared) counted_twice += names[inode]++ > 0 ? bytes : 0;
    auto& one = *usage.add_jobs() = job_usage(job, use);
    add_to_owner(owners[job.owner()], one);
    usage.set_disk_bytes(usage.disk_bytes() + use.bytes);
    usage.set_rank_seconds(usage.rank_seconds() + job.rank_seconds());
    usage.set_memory_bytes(usage.memory_bytes() + job.memory_bytes());
  }
  usage.set_disk_bytes(usage.disk_bytes() - counted_twice);
  usage.set_jobs_kept(static_cast<std::uint32_t>(jobs.size()));
  usage.set_unix_nanos(now_nanos());
  const auto larger = [](const auto& a, const auto& b) { return a.bytes() > b.bytes(); };
  std::stable_sort(usage.mutable_jobs()->begin(), usage.mutable_jobs()->end(), larger);
  for (auto& [owner, of_owner] : owners) {
    measured.owner_bytes[owner] = of_owner.bytes();
    *usage.add_owners() = std::move(of_owner);
  }
  std::stable_sort(usage.mutable_owners()->begin(), usage.mutable_owners()->end(), larger);
  measured.bytes = usage.disk_bytes();
  std::set<std::string> there;
  for (const auto& job : jobs) there.insert(job.id());
  std::erase_if(known_, [&](const auto& entry) { return !there.contains(entry.first); });
  jobs_.take_measured(std::move(measured));
  const std::lock_guard guard(mutex_);
  usage_ = std::move(usage);
  looked_ = now;
  return jobs;
}

v1::Usage UsageBook::usage(std::chrono::milliseconds oldest) {
  {
    const std::lock_guard guard(mutex_);
    if (Clock::now() - looked_ < oldest) return usage_;
  }
  look();
  const std::lock_guard guard(mutex_);
  return usage_;
}

v1::Usage UsageBook::answer(const v1::GetUsageRequest& request) {
  v1::Usage answer = usage(1s);
  const auto is_others = [&](const auto& one) { return request.has_owner() && one.owner() != request.owner(); };
  auto& jobs = *answer.mutable_jobs();
  jobs.erase(std::remove_if(jobs.begin(), jobs.end(), is_others), jobs.end());
  if (static_cast<std::uint32_t>(jobs.size()) > request.most())
    jobs.DeleteSubrange(static_cast<int>(request.most()), jobs.size() - static_cast<int>(request.most()));
  auto& owners = *answer.mutable_owners();
  owners.erase(std::remove_if(owners.begin(), owners.end(), is_others), owners.end());
  jobs_.add_limits(answer);
  return answer;
}

}  // namespace bedflow::server
