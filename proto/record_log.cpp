// The framed, checksummed log. CRC32C (Castagnoli) by ISA-L, which leaves the inversions before and after to its caller.
#include "record_log.h"

#include <fcntl.h>
#ifdef __SSE4_2__
#include <nmmintrin.h>
#endif
#include <isa-l/crc.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <optional>
#include <system_error>

#include "open_file.h"

namespace bedflow {
namespace {

static_assert(std::endian::native == std::endian::little, "logs are little-endian");

constexpr std::size_t header_bytes = 20;
constexpr std::size_t chunk_bytes = 1 << 20;
constexpr std::size_t most_payload_bytes = 1 << 28;

[[noreturn]] void fail(int error, const std::string& doing, const std::filesystem::path& path) {
  throw std::system_error(error, std::generic_category(), doing + " " + path.string());
}

template <typename T>
T number_at(std::string_view bytes, std::size_t place) {
  T value;
  std::memcpy(&value, bytes.data() + place, sizeof value);
  return value;
}

std::string frame(std::uint32_t type, std::uint64_t sequence, std::string_view payload) {
  std::string bytes(header_bytes + payload.size(), '\0');
  const auto length = static_cast<std::uint32_t>(payload.size());
  std::memcpy(bytes.data(), &length, 4);
  std::memcpy(bytes.data() + 4, &type, 4);
  std::memcpy(bytes.data() + 8, &sequence, 8);
  std::copy(payload.begin(), payload.end(), bytes.begin() + header_bytes);
  const std::uint32_t sum = crc32c(payload, crc32c(std::string_view(bytes).substr(4, 12)));
  std::memcpy(bytes.data() + 16, &sum, 4);
  return bytes;
}

// Bytes of the whole record that starts here by its length field; nothing when even the header is cut.
std::optional<std::size_t> record_bytes(std::string_view bytes) {
  if (bytes.size() < header_bytes) return std::nullopt;
  return header_bytes + number_at<std::uint32_t>(bytes, 0);
}

bool is_sound(std::string_view bytes) {
  const auto size = record_bytes(bytes);
  if (!size || *size > bytes.size()) return false;
  const std::string_view payload = bytes.substr(header_bytes, *size - header_bytes);
  return number_at<std::uint32_t>(bytes, 16) == crc32c(payload, crc32c(bytes.substr(4, 12)));
}

// Whether a sound, later record follows the damage at the start of `bytes`: then the damage is not a torn end.
bool later_record_follows(std::string_view bytes, std::uint64_t expected) {
  for (std::size_t place = 1; place + header_bytes <= bytes.size(); ++place) {
    const std::string_view rest = bytes.substr(place);
    const auto sequence = number_at<std::uint64_t>(rest, 8);
    if (sequence > expected && sequence - expected < most_payload_bytes && is_sound(rest)) return true;
  }
  return false;
}

// Into the memory that `bytes` has.
void read_at(int file, std::uint64_t offset, std::size_t most, const std::filesystem::path& path, std::string& bytes) {
  struct stat status {};
  if (::fstat(file, &status) != 0) fail(errno, "reading", path);
  const auto end = static_cast<std::uint64_t>(status.st_size);
  most = std::min<std::uint64_t>(most, end - std::min(end, offset));
  bytes.resize(most);
  std::size_t have = 0;
  while (have < most) {
    const ssize_t got = ::pread(file, bytes.data() + have, most - have, static_cast<off_t>(offset + have));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(errno, "reading", path);
    if (got == 0) break;
    have += static_cast<std::size_t>(got);
  }
  bytes.resize(have);
}

// Records are short, most of them: for these the processor's own instruction takes a fraction of what ISA-L's way to long ones
// takes before it begins.
#ifdef __SSE4_2__
constexpr std::size_t most_short_bytes = 128;

std::uint32_t sum_short(std::string_view bytes, std::uint32_t sum) {
  std::uint64_t wide = sum;
  for (; bytes.size() >= 8; bytes.remove_prefix(8)) wide = _mm_crc32_u64(wide, number_at<std::uint64_t>(bytes, 0));
  sum = static_cast<std::uint32_t>(wide);
  for (const char byte : bytes) sum = _mm_crc32_u8(sum, static_cast<unsigned char>(byte));
  return sum;
}
#endif

}  // namespace

std::uint32_t crc32c(std::string_view bytes, std::uint32_t so_far) {
  std::uint32_t sum = ~so_far;
#ifdef __SSE4_2__
  if (bytes.size() <= most_short_bytes) return ~sum_short(bytes, sum);
#endif
  while (!bytes.empty()) {  // ISA-L counts in int
    const std::size_t part = std::min<std::size_t>(bytes.size(), 1 << 30);
    auto* start = reinterpret_cast<unsigned char*>(const_cast<char*>(bytes.data()));  // its prototype lacks the const
    sum = crc32_iscsi(start, static_cast<int>(part), sum);
    bytes.remove_prefix(part);
  }
  return ~sum;
}

LogWriter::LogWriter(const std::filesystem::path& path) : path_(path) {
  LogReader reader(path);
  if (!reader.read([&](const LogRecord& record) { next_sequence_ = record.sequence + 1; })) {
    fail(EBADMSG, "a record in the middle (byte " + std::to_string(reader.offset()) + ") is damaged in", path);
  }
  end_ = reader.offset();
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0) fail(errno, "opening", path);
  if (::ftruncate(file_, static_cast<off_t>(end_)) != 0) {
    const int error = errno;
    ::close(file_);
    fail(error, "cutting the torn end of", path);
  }
}

LogWriter::~LogWriter() {
  if (file_ >= 0) ::close(file_);
}

std::uint64_t LogWriter::append(std::uint32_t type, std::string_view payload) {
  if (payload.size() > most_payload_bytes) fail(EMSGSIZE, "appending to", path_);
  const std::string bytes = frame(type, next_sequence_, payload);
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t got = ::write(file_, bytes.data() + written, bytes.size() - written);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      const int error = errno;
      // Part of the record may be there (a disk that is full): without the cut the next record would follow a torn one.
      if (written > 0 && ::ftruncate(file_, static_cast<off_t>(end_)) != 0)
        fail(errno, "cutting a half-written record of", path_);
      fail(error, "appending to", path_);
    }
    written += static_cast<std::size_t>(got);
  }
  end_ += bytes.size();
  return next_sequence_++;
}

void LogWriter::sync() {
  if (::fdatasync(file_) != 0) fail(errno, "syncing", path_);
}

bool LogReader::read_up_to(std::size_t most, const std::function<void(const LogRecord&)>& take) {
  const OpenFile file(path_, O_RDONLY);
  if (file.get() < 0) {
    if (errno == ENOENT) return true;  // not begun yet
    fail(errno, "opening", path_);
  }
  std::size_t taken = 0;
  LogRecord record;  // its memory serves all
  const auto is_next = [&](std::string_view bytes) {
    return is_sound(bytes) && number_at<std::uint64_t>(bytes, 8) == next_sequence_;
  };
  std::string bytes;
  for (std::size_t chunk = chunk_bytes;;) {
    read_at(file.get(), offset_, chunk, path_, bytes);
    std::string_view rest = bytes;
    while (is_next(rest)) {
      if (taken++ == most) return true;
      const std::size_t size = *record_bytes(rest);
      record.type = number_at<std::uint32_t>(rest, 4);
      record.sequence = next_sequence_;
      record.payload.assign(rest, header_bytes, size - header_bytes);
      offset_ += size;
      ++next_sequence_;
      rest.remove_prefix(size);
      take(record);
    }
    if (rest.empty() && bytes.size() < chunk) return true;
    const auto size = record_bytes(rest);
    const bool may_go_on =
        bytes.size() == chunk && (!size || (*size > rest.size() && *size <= header_bytes + most_payload_bytes));
    if (!may_go_on) {                    // torn or damaged
      if (is_sound(rest)) return false;  // whole, but with a number out of turn
      std::string all;
      read_at(file.get(), offset_, most_payload_bytes, path_, all);
      if (is_next(all)) continue;  // it was being written
      return !later_record_follows(all, next_sequence_);
    }
    chunk = std::max(chunk_bytes, size.value_or(0));
  }
}

}  // namespace bedflow
