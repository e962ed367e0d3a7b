#include "checkpoint/posix_file.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statfs.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace bedflow {

Stop system_stop(const std::filesystem::path& path, const char* what, int error) {
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  return Stop(full ? Reason::disk_full : Reason::internal,
              "cannot " + std::string(what) + " " + path.string() + ": " + std::strerror(error));
}

PosixFile::PosixFile(std::filesystem::path path, Mode mode) : path_(std::move(path)) {
  const int flags = mode == Mode::write    ? O_RDWR
                    : mode == Mode::create ? O_RDWR | O_CREAT | O_TRUNC
                    : mode == Mode::read   ? O_RDONLY
                                           : O_RDONLY | O_DIRECTORY;
  descriptor_ = ::open(path_.c_str(), flags | O_CLOEXEC, 0644);
  if (descriptor_ < 0) fail("open", errno);
}

PosixFile::~PosixFile() {
  ::close(descriptor_);
}

void PosixFile::fail(const char* what, int error) const {
  throw system_stop(path_, what, error);
}

std::uint64_t PosixFile::bytes() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail("look at", errno);
  return static_cast<std::uint64_t>(status.st_size);
}

std::size_t PosixFile::read(std::span<std::byte> into, std::uint64_t place) const {
  std::size_t done = 0;
  while (done < into.size()) {
    const ssize_t got = ::pread(descriptor_, into.data() + done, into.size() - done, static_cast<off_t>(place + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail("read", errno);
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

void PosixFile::write(std::span<const std::byte> from, std::uint64_t place) const {
  std::size_t done = 0;
  while (done < from.size()) {
    const ssize_t put = ::pwrite(descriptor_, from.data() + done, from.size() - done, static_cast<off_t>(place + done));
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) fail("write", errno);
    done += static_cast<std::size_t>(put);
  }
}

void PosixFile::reserve(std::uint64_t bytes) const {
  int error = EINTR;
  while (error == EINTR) error = ::posix_fallocate(descriptor_, 0, static_cast<off_t>(bytes));
  if (error != 0) fail("find room for", error);
}

void PosixFile::sync() const {
  if (::fsync(descriptor_) != 0) fail("sync", errno);
}

MemoryFile::MemoryFile() {
  std::string name = "/dev/shm/bedflow-XXXXXX";
  descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (descriptor_ < 0) throw system_stop(name, "create", errno);
  path_ = name;
}

MemoryFile::~MemoryFile() {
  unname();
  ::close(descriptor_);
}

void MemoryFile::unname() {
  if (!path_.empty()) ::unlink(path_.c_str());
  path_.clear();
}

std::uint64_t MemoryFile::write_to(const std::filesystem::path& path) const {
  const PosixFile from("/proc/self/fd/" + std::to_string(descriptor_), PosixFile::Mode::read), to(path, PosixFile::Mode::create);
  const std::uint64_t length = from.bytes();
  if (length > 0) to.reserve(length);
  std::vector<std::byte> buffer(1 << 20);
  off_t end = 0;
  for (off_t start = 0; (start = ::lseek(descriptor_, end, SEEK_DATA)) >= 0;) {
    end = ::lseek(descriptor_, start, SEEK_HOLE);
    for (auto place = static_cast<std::uint64_t>(start); place < static_cast<std::uint64_t>(end);) {
      const auto part = std::span(buffer).first(std::min<std::uint64_t>(buffer.size(), static_cast<std::uint64_t>(end) - place));
      const std::size_t got = from.read(part, place);
      to.write(part.first(got), place);
      place += got;
      if (got < part.size()) break;
    }
  }
  return length;
}

void check_room(const std::filesystem::path& folder, std::uint64_t bytes) {
  struct statvfs device {};
  if (::statvfs(folder.c_str(), &device) != 0) throw system_stop(folder, "look at", errno);
  const std::uint64_t free = std::uint64_t{device.f_bavail} * device.f_frsize;
  if (free < bytes) {
    throw Stop(Reason::disk_full, "no room in " + folder.string() + ": " + std::to_string(bytes) + " bytes are needed, " +
                                      std::to_string(free) + " are free; free some space and resume the job");
  }
  struct rlimit limit {};
  if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur < bytes) {
    throw Stop(Reason::disk_full, "a file of " + std::to_string(bytes) + " bytes in " + folder.string() +
                                      " is above this process's limit of " + std::to_string(limit.rlim_cur) +
                                      " bytes; raise it (ulimit -f) and resume the job");
  }
}

bool is_on_network_disk(const std::filesystem::path& folder) {
  struct statfs system {};
  if (::statfs(folder.c_str(), &system) != 0) throw system_stop(folder, "look at", errno);
  const auto kind = static_cast<std::uint32_t>(system.f_type);
  return kind == NFS_SUPER_MAGIC || kind == SMB_SUPER_MAGIC || kind == CIFS_SUPER_MAGIC || kind == SMB2_SUPER_MAGIC;
}

void rename_for_good(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (::rename(from.c_str(), to.c_str()) != 0) throw system_stop(from, "rename", errno);
  PosixFile(to.parent_path(), PosixFile::Mode::folder).sync();
}

}  // namespace bedflow
