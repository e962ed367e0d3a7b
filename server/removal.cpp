// Deleting jobs. A folder is renamed away first and removed last, with the catalogue in between: whenever the server dies, the
// next one finds either the job as it was, or what it has to finish.
#include <spdlog/spdlog.h>

#include "jobs.h"
#include "refusal.h"

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

// Files that other jobs have too (a checkpoint that they started from) free nothing.
std::uint64_t bytes_freed(const fs::path& folder) {
  std::uint64_t bytes = 0;
  std::error_code gone;
  for (const auto& entry : fs::recursive_directory_iterator(folder, gone)) {
    const bool only_here = entry.is_regular_file(gone) && entry.hard_link_count(gone) == 1;
    if (only_here) bytes += entry.file_size(gone);
  }
  return bytes;
}

}  // namespace

std::uint64_t Jobs::remove(const Caller& caller, const std::string& id) {
  const auto removed = settings_.data / "removed" / id;
  {
    const std::lock_guard guard(mutex_);
    const JobRecord record = own_record(caller, id);
    const auto state = record.job.state();
    if (live_.contains(id) || (!is_final(state) && state != v1::STATE_SUSPENDED)) {
      throw Refusal(Refused::wrong_state, "job " + id + " is " + state_word(state) + " and cannot be deleted before it has ended",
                    "bedflow cancel " + id);
    }
    require_no_pin(record);
    if (fs::exists(folder_of(id).root())) {  // one that was cancelled before it began has none
      fs::create_directories(removed.parent_path());
      fs::rename(folder_of(id).root(), removed);
      sync_folder(removed.parent_path());
      sync_folder(folder_of(id).root().parent_path());
    }
    catalogue_.erase(id, now_nanos() / 1'000'000'000);
    feeds_.erase(id);
  }
  const std::uint64_t freed = bytes_freed(removed);
  fs::remove_all(removed);
  spdlog::info("{} is deleted; {} bytes are free again", id, freed);
  return freed;
}

void Jobs::finish_removals() {
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(settings_.data / "removed", none)) {
    catalogue_.erase(entry.path().filename(), now_nanos() / 1'000'000'000);
    fs::remove_all(entry.path());
  }
}

}  // namespace bedflow::server
