#include "backup.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "catalogue.h"
#include "security.h"

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

// What a server makes anew, or what is of the moment.
bool is_left_out(const std::string& name) {
  static const std::set<std::string> names = {"lock", "drafts", "removed", "jobs"};
  return names.contains(name) || name.starts_with("catalogue.sqlite") || name.ends_with(".sock") || name.ends_with(".partial");
}

bool is_same(const fs::directory_entry& from, const fs::path& to) {
  std::error_code missing;
  const auto size = fs::file_size(to, missing);
  return !missing && size == from.file_size() && fs::last_write_time(to) == from.last_write_time();
}

class Copy {
 public:
  // Files that go while it copies are left out; what is no longer there goes from the copy too.
  void folder(const fs::path& from, const fs::path& to) {
    fs::create_directories(to);
    std::vector<fs::directory_entry> entries;
    std::error_code gone;
    for (const auto& entry : fs::directory_iterator(from, gone)) {
      if (!is_left_out(entry.path().filename())) entries.push_back(entry);
    }
    // Folders first: a checkpoint must not be newer than the statistics beside it.
    std::stable_partition(entries.begin(), entries.end(), [](const auto& entry) { return entry.is_directory(); });
    std::set<std::string> names;
    for (const auto& entry : entries) {
      const std::string name = entry.path().filename();
      names.insert(name);
      if (entry.is_directory(gone))
        folder(entry.path(), to / name);
      else if (entry.is_regular_file(gone))
        file(entry, to / name);
    }
    keep_only(names, to);
  }
  static void keep_only(const std::set<std::string>& names, const fs::path& folder) {
    std::vector<fs::path> extra;
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename();
      if (!names.contains(name) && !is_left_out(name)) extra.push_back(entry.path());
    }
    for (const auto& path : extra) fs::remove_all(path);
  }
  BackupReport report;

 private:
  // Another name of a file that has been copied becomes another name of the copy.
  bool is_linked(const fs::path& from, const fs::path& to) {
    struct stat status {};
    if (::stat(from.c_str(), &status) != 0 || status.st_nlink < 2) return false;
    const auto [known, is_new] = copied_.try_emplace(status.st_ino, to);
    if (is_new) return false;
    std::error_code failed;
    fs::remove(to, failed);
    fs::create_hard_link(known->second, to, failed);
    return !failed;
  }
  void file(const fs::directory_entry& from, const fs::path& to) {
    try {
      if (is_same(from, to) || is_linked(from.path(), to)) return;
      const auto time = from.last_write_time();
      const fs::path part = to.string() + ".partial";
      fs::copy_file(from.path(), part, fs::copy_options::overwrite_existing);
      fs::last_write_time(part, time);
      report.bytes += fs::file_size(part);
      ++report.files;
      fs::rename(part, to);
    } catch (const fs::filesystem_error& failure) {
      if (failure.code() != std::errc::no_such_file_or_directory || fs::exists(from.path())) throw;
    }
  }

  std::map<ino_t, fs::path> copied_;  // of files with several names
};

void sync_all(const fs::path& folder) {
  const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0 || ::syncfs(file) != 0) throw std::system_error(errno, std::generic_category(), "syncing " + folder.string());
  ::close(file);
}

}  // namespace

BackupReport back_up(const fs::path& data, const fs::path& to) {
  const fs::path catalogue = data / "catalogue.sqlite";
  if (!fs::exists(catalogue))
    throw std::invalid_argument("--data " + data.string() + " is no data folder of a bedflowd: it has no catalogue");
  fs::create_directories(to);
  if (fs::equivalent(data, to)) throw std::invalid_argument("--to " + to.string() + " is the data folder itself");
  if (!fs::is_empty(to) && !fs::exists(to / "catalogue.sqlite"))
    throw std::invalid_argument("--to " + to.string() + " is neither empty nor an earlier backup");
  make_private(to);
  const fs::path part = to / "catalogue.sqlite.partial";
  fs::remove(part);
  Catalogue::copy(catalogue, part);
  std::set<std::string> ids;
  {
    const Catalogue copied(part);
    for (const auto& record : copied.page(std::numeric_limits<std::int64_t>::max(), {}, -1)) ids.insert(record.job.id());
  }
  Copy copy;
  copy.folder(data, to);
  fs::create_directories(to / "jobs");
  for (const auto& id : ids) {
    if (!fs::exists(data / "jobs" / id)) continue;  // it has not begun, or was deleted meanwhile
    copy.folder(data / "jobs" / id, to / "jobs" / id);
    ++copy.report.jobs;
  }
  Copy::keep_only(ids, to / "jobs");
  for (const char* const suffix : {"-wal", "-shm"}) {
    fs::remove(part.string() + suffix);
    fs::remove(to / (std::string("catalogue.sqlite") + suffix));
  }
  fs::rename(part, to / "catalogue.sqlite");
  sync_all(to);
  return copy.report;
}

}  // namespace bedflow::server
