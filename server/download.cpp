#include "download.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "record_log.h"
#include "refusal.h"

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t part_bytes = 1 << 20;
constexpr std::size_t seal_bytes = 512;            // a checkpoint's first bytes hold the checksums of all others
constexpr std::uint64_t most_upload = 1ULL << 40;  // 1 TiB
constexpr std::uint64_t least_upload = seal_bytes;

std::string bytes_at(int file, std::uint64_t place, std::size_t most) {
  std::string bytes(most, '\0');
  std::size_t have = 0;
  while (have < most) {
    const ssize_t got = ::pread(file, bytes.data() + have, most - have, static_cast<off_t>(place + have));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw std::system_error(errno, std::generic_category(), "reading a checkpoint");
    if (got == 0) break;
    have += static_cast<std::size_t>(got);
  }
  bytes.resize(have);
  return bytes;
}

std::string hexadecimal(std::uint32_t number) {
  std::array<char, 9> text{};
  std::snprintf(text.data(), text.size(), "%08x", number);
  return text.data();
}

}  // namespace

Download::Download(const JobFolder& folder, const v1::DownloadCheckpointRequest& request) : offset_(request.offset()) {
  const auto& name = request.name();
  for (const auto step : folder.checkpoint_steps()) {
    if (name.has_step() && step != name.step()) continue;
    file_ = ::open(folder.checkpoint(step).c_str(), O_RDONLY | O_CLOEXEC);
    step_ = step;
    if (file_ >= 0) break;
  }
  const std::string list = "bedflow checkpoint list " + name.job();
  if (file_ < 0) {
    throw Refusal(Refused::checkpoint_not_found,
                  "job " + name.job() + " has no checkpoint" + (name.has_step() ? " of step " + std::to_string(name.step()) : ""),
                  list);
  }
  struct stat status {};
  if (::fstat(file_, &status) != 0) throw std::system_error(errno, std::generic_category(), "looking at a checkpoint");
  bytes_ = static_cast<std::uint64_t>(status.st_size);
  seal_ = hexadecimal(crc32c(bytes_at(file_, 0, seal_bytes))) + "-" + std::to_string(bytes_);
  if (!request.seal().empty() && request.seal() != seal_) {
    throw Refusal(Refused::checkpoint_changed,
                  "the checkpoint of step " + std::to_string(step_) + " is " + seal_ + "; the download began with another",
                  "begin again without the part that is there; " + list);
  }
  if (offset_ > bytes_) {
    throw Refusal(Refused::bad_request, "offset is " + std::to_string(offset_) + "; allowed are 0 to " + std::to_string(bytes_) +
                                            ", the file's length");
  }
}

Download::~Download() {
  if (file_ >= 0) ::close(file_);
}

bool Download::next(v1::DownloadCheckpointResponse& part) {
  const bool first = !std::exchange(begun_, true);
  if (!first && offset_ >= bytes_) return false;
  if (first) {
    part.set_step(step_);
    part.set_bytes(bytes_);
    part.set_seal(seal_);
    part.set_file(JobFolder::checkpoint_name(step_));
  }
  std::string data = bytes_at(file_, offset_, std::min<std::uint64_t>(part_bytes, bytes_ - offset_));
  if (data.empty() && offset_ < bytes_) throw Refusal(Refused::checkpoint_corrupt, "the checkpoint was cut while it was sent");
  part.set_offset(offset_);
  part.set_crc32c(crc32c(data));
  offset_ += data.size();
  part.set_data(std::move(data));
  return true;
}

// ---------------------------------------------------------------------------------------------------------- upload

Upload::Upload(const fs::path& file, const v1::ImportCheckpointRequest::Head& head) : bytes_(head.bytes()) {
  if (bytes_ < least_upload || bytes_ > most_upload) {
    throw Refusal(Refused::bad_upload, "bytes is " + std::to_string(bytes_) + "; a checkpoint has " +
                                           std::to_string(least_upload) + " to " + std::to_string(most_upload));
  }
  constexpr std::uint64_t reserve = 64 << 20;
  const auto free = fs::space(file.parent_path()).available;
  if (free < reserve || (free - reserve) / 2 < bytes_) {  // it is there twice while it is checked
    throw Refusal(
        Refused::disk_full,
        "an import of " + std::to_string(bytes_) + " bytes needs twice that; " + std::to_string(free) + " bytes are free",
        "bedflow server info");
  }
  file_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file_ < 0) throw std::system_error(errno, std::generic_category(), "creating " + file.string());
}

Upload::~Upload() {
  if (file_ >= 0) ::close(file_);
}

void Upload::take(const v1::ImportCheckpointRequest& part) {
  if (part.offset() != have_)
    throw Refusal(Refused::bad_upload,
                  "the part at " + std::to_string(part.offset()) + " came where " + std::to_string(have_) + " was due");
  if (part.data().size() > bytes_ - have_)
    throw Refusal(Refused::bad_upload, "more came than the " + std::to_string(bytes_) + " bytes that were announced");
  if (crc32c(part.data()) != part.crc32c())
    throw Refusal(Refused::bad_upload, "the part at " + std::to_string(have_) + " has not the checksum that it was sent with");
  crc_ = crc32c(part.data(), crc_);
  for (std::size_t done = 0; done < part.data().size();) {
    const ssize_t put = ::write(file_, part.data().data() + done, part.data().size() - done);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) throw std::system_error(errno, std::generic_category(), "writing an import");
    done += static_cast<std::size_t>(put);
  }
  have_ += part.data().size();
}

std::uint32_t Upload::finish() {
  if (have_ != bytes_)
    throw Refusal(Refused::bad_upload, std::to_string(have_) + " of " + std::to_string(bytes_) + " bytes came");
  return crc_;
}

}  // namespace bedflow::server
