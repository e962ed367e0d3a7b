// An append-only log of records, each framed as
//   length (4 bytes) · type (4 bytes) · sequence (8 bytes) · CRC32C of type, sequence and payload (4 bytes) · payload
// little-endian. A record that was torn by a crash can only be the last one; readers stop before it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace bedflow {

std::uint32_t crc32c(std::string_view bytes, std::uint32_t so_far = 0);

struct LogRecord {
  std::uint32_t type = 0;
  std::uint64_t sequence = 0;
  std::string payload;
};

class LogWriter {
 public:
  // Opens or creates; cuts off a torn last record; goes on with the next sequence number. Throws std::system_error
  // (EBADMSG: a record in the middle is damaged; nothing is cut then).
  explicit LogWriter(const std::filesystem::path& path);
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  std::uint64_t next_sequence() const { return next_sequence_; }
  // One write(2) a record, so that readers see whole records or a torn tail. Throws std::system_error (ENOSPC among them).
  std::uint64_t append(std::uint32_t type, std::string_view payload);
  void sync();  // fdatasync

 private:
  std::filesystem::path path_;
  int file_ = -1;
  std::uint64_t end_ = 0;  // bytes of whole records
  std::uint64_t next_sequence_ = 1;
};

// Follows a log from the start or from an offset; call read() again as the file grows.
class LogReader {
 public:
  explicit LogReader(std::filesystem::path path) : path_(std::move(path)) {}
  // Calls `take` for each complete new record. A log that does not exist yet has none. False when a record that is not the
  // last is damaged or out of turn; offset() is then its first byte. Throws std::system_error when the file cannot be read.
  bool read(const std::function<void(const LogRecord&)>& take) { return read_up_to(SIZE_MAX, take); }
  // The same for at most so many records: a follower with a bound on what it holds.
  bool read_up_to(std::size_t most, const std::function<void(const LogRecord&)>& take);
  std::uint64_t offset() const { return offset_; }

 private:
  std::filesystem::path path_;
  std::uint64_t offset_ = 0;
  std::uint64_t next_sequence_ = 1;
};

}  // namespace bedflow
