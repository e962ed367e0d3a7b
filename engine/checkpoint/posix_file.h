// An open file, read and written at places. Every failure is a Stop with the file's name and the system's reason:
// disk_full where there is no room (device, quota or limit on file sizes), internal otherwise.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "base/stop.h"

namespace bedflow {

class PosixFile {
 public:
  enum class Mode { read, write, create, folder };

  PosixFile(std::filesystem::path path, Mode mode);
  ~PosixFile();
  PosixFile(const PosixFile&) = delete;
  PosixFile& operator=(const PosixFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t bytes() const;
  // Reads as much as there is; less than asked for only at the file's end. Returns the bytes read.
  std::size_t read(std::span<std::byte> into, std::uint64_t place) const;
  void write(std::span<const std::byte> from, std::uint64_t place) const;
  void reserve(std::uint64_t bytes) const;  // posix_fallocate
  void sync() const;                        // fsync

 private:
  [[noreturn]] void fail(const char* what, int error) const;

  std::filesystem::path path_;
  int descriptor_ = -1;
};

// A sparse file in memory (/dev/shm), for a checkpoint's layout. HDF5 never writes to a disk: what it has open when it meets a
// full one it cannot close any more, and it ends the program over that.
class MemoryFile {
 public:
  MemoryFile();
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  void unname();  // once it is open: a process that is killed leaves nothing behind
  // The same bytes as a new file of that name, holes reserved and zero. Returns their number.
  std::uint64_t write_to(const std::filesystem::path& path) const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
};

// The Stop for a system call that failed with `error` (errno).
Stop system_stop(const std::filesystem::path& path, const char* what, int error);

// Throws disk_full when a file of so many bytes has no room in the folder, by the device's free space and the limit on file
// sizes.
void check_room(const std::filesystem::path& folder, std::uint64_t bytes);

// Whether the folder is on NFS or SMB, whose clients keep pages of a file to themselves until it is closed.
bool is_on_network_disk(const std::filesystem::path& folder);

// Renames and makes the name last: fsync of the folder.
void rename_for_good(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace bedflow
