#include "durable_file.h"

#include <google/protobuf/text_format.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "open_file.h"

namespace bedflow {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(int error, const std::string& doing, const fs::path& path) {
  throw std::system_error(error, std::generic_category(), doing + " " + path.string());
}

// The file that is to take the place of `path`; gone again when it does not come to that.
class Beside {
 public:
  explicit Beside(const fs::path& path) : path_(path.string() + ".new"), file_(path_, O_WRONLY | O_CREAT, 0600) {
    if (file_.get() < 0) fail(errno, "creating", path_);
  }
  [[noreturn]] void give_up(int error, const std::string& doing) const {
    ::unlink(path_.c_str());
    fail(error, doing, path_);
  }
  int file() const { return file_.get(); }
  const fs::path& path() const { return path_; }

 private:
  const fs::path path_;
  const OpenFile file_;
};

}  // namespace

void write_durably(const fs::path& path, std::string_view content) {
  const Beside beside(path);
  const auto size = static_cast<off_t>(content.size());
  while (!content.empty()) {
    const ssize_t written = ::write(beside.file(), content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) beside.give_up(errno, "writing");
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  if (::ftruncate(beside.file(), size) != 0 || ::fsync(beside.file()) != 0) beside.give_up(errno, "writing");
  if (::rename(beside.path().c_str(), path.c_str()) != 0) fail(errno, "replacing", path);
  sync_folder(path.parent_path());
}

void write_durably(const fs::path& path, const google::protobuf::Message& message) {
  std::string text;
  google::protobuf::TextFormat::PrintToString(message, &text);
  write_durably(path, text);
}

void reserve(const fs::path& path) {
  const Beside beside(path);
  if (const int error = ::posix_fallocate(beside.file(), 0, 4096); error != 0) beside.give_up(error, "finding room for");
}

void sync_folder(const fs::path& folder) {
  const OpenFile file(folder, O_RDONLY | O_DIRECTORY);
  if (file.get() < 0) fail(errno, "opening", folder);
  if (::fsync(file.get()) != 0) fail(errno, "syncing", folder);
}

}  // namespace bedflow
