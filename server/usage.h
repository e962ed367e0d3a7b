// What jobs take of disk, memory and time, by job and by owner.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "jobs.h"

namespace bedflow::server {

struct FolderUse {
  std::uint64_t bytes = 0, checkpoint_bytes = 0;
  std::uint32_t checkpoints = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> shared;  // inode and bytes of files that have other names too
};
// Of all files below; one with several names counts once. Files that go while it looks are left out.
FolderUse folder_use(const std::filesystem::path& folder);

// Looks at the jobs' folders: those that have changed, and those of running jobs. Safe from any thread.
class UsageBook {
 public:
  explicit UsageBook(Jobs& jobs) : jobs_(jobs) {}

  // Every job, newest first; what they take is known then, and the jobs are told (quotas, memory).
  std::vector<v1::Job> look();
  // From the last look, or a new one if that is older than so long.
  v1::Usage usage(std::chrono::milliseconds oldest);
  v1::Usage answer(const v1::GetUsageRequest& request);

 private:
  struct Known {
    std::int64_t changed = 0;
    std::uint64_t sequence = 0;
    std::chrono::steady_clock::time_point looked{};
    FolderUse use;
  };
  const FolderUse& known_use(const v1::Job& job, std::chrono::steady_clock::time_point now);

  Jobs& jobs_;
  std::mutex looking_;  // over known_
  std::map<std::string, Known> known_;
  std::mutex mutex_;  // over the two below
  v1::Usage usage_;
  std::chrono::steady_clock::time_point looked_{};
};

}  // namespace bedflow::server
