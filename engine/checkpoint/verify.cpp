// Judging checkpoint files: which are there, whether one is good, and which is the newest good one.
#include <algorithm>
#include <cstring>

#include "checkpoint/agree.h"
#include "checkpoint/checkpoint.h"
#include "checkpoint/file_names.h"
#include "checkpoint/seal.h"

namespace bedflow {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t most_faults = 20;  // named one by one

std::vector<std::string> faults_of(const PosixFile& file, std::optional<Seal>& seal) {
  std::string fault;
  seal = Seal::read(file, fault);
  if (!seal) return {fault};
  std::vector<std::string> faults;
  const std::uint64_t length = file.bytes();
  if (length < seal->file_bytes) {
    faults.push_back("cut short: " + std::to_string(length) + " of " + std::to_string(seal->file_bytes) + " bytes are there");
  } else if (length > seal->file_bytes) {
    faults.push_back("too long: " + std::to_string(length) + " bytes instead of " + std::to_string(seal->file_bytes));
  }
  const std::optional<Manifest> manifest = read_manifest(file, *seal, fault);
  if (!manifest) {
    faults.push_back(fault);
    return faults;
  }
  const std::vector<std::string> blocks = faulty_blocks(file, *manifest);
  faults.insert(faults.end(), blocks.begin(), blocks.begin() + static_cast<std::ptrdiff_t>(std::min(blocks.size(), most_faults)));
  if (blocks.size() > most_faults) faults.push_back("and " + std::to_string(blocks.size() - most_faults) + " more blocks");
  if (length >= seal->file_bytes && metadata_checksum(file, *seal, *manifest) != seal->metadata_crc) {
    faults.push_back("metadata (names, shapes, attributes): checksum does not match, bytes were changed");
  }
  return faults;
}

std::vector<std::string> faults_of(const fs::path& path, std::optional<Seal>& seal) {
  try {
    return faults_of(PosixFile(path, PosixFile::Mode::read), seal);
  } catch (const std::exception& error) {
    return {error.what()};
  }
}

}  // namespace

std::vector<std::string> verify_checkpoint(const fs::path& path) {
  std::optional<Seal> seal;
  return faults_of(path, seal);
}

std::vector<CheckpointInfo> list_checkpoints(const fs::path& folder) {
  std::vector<CheckpointInfo> found;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::optional<std::uint64_t> step = step_of_checkpoint(entry.path());
    if (step && entry.is_regular_file(none)) found.push_back({entry.path(), *step, 0, entry.file_size(none)});
  }
  std::sort(found.begin(), found.end(), [](const CheckpointInfo& a, const CheckpointInfo& b) { return a.step > b.step; });
  return found;
}

std::optional<CheckpointInfo> newest_good_checkpoint(const Comm& comm, const fs::path& folder, std::vector<std::string>& faults) {
  std::string good, wrong;  // a path; lines
  std::optional<Seal> seal;
  if (comm.root()) {
    for (const CheckpointInfo& info : list_checkpoints(folder)) {
      const std::vector<std::string> found = faults_of(info.path, seal);
      for (const std::string& fault : found) wrong += info.path.filename().string() + ": " + fault + "\n";
      if (!found.empty()) continue;
      good = info.path;
      break;
    }
  }
  good = comm.broadcast(good);
  wrong = comm.broadcast(wrong);
  Seal told = seal.value_or(Seal{});
  comm.broadcast(std::as_writable_bytes(std::span(&told, 1)));
  for (std::size_t end; (end = wrong.find('\n')) != std::string::npos; wrong.erase(0, end + 1))
    faults.push_back(wrong.substr(0, end));
  if (good.empty()) return std::nullopt;
  return CheckpointInfo{good, told.step, told.time, told.file_bytes};
}

}  // namespace bedflow
