// What makes every byte of a checkpoint accountable, without HDF5.
//
// A checkpoint file is
//   seal        512 bytes, HDF5's user block: step, time, the file's length, the manifest's place and checksum, the
//               metadata's checksum, and a checksum of the seal itself in its last 4 bytes
//   the HDF5 file: datasets at the places the manifest names, and HDF5's own metadata everywhere else
// The manifest is a dataset of text: name, place, length and the CRC32C of each MiB block of every other dataset.
// So a file can be judged before HDF5 sees a byte of it. Numbers are little-endian.
// CRC32C: Castagnoli's polynomial 0x1EDC6F41, RFC 3720 section 12.1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "checkpoint/posix_file.h"

namespace bedflow {

inline constexpr std::uint64_t seal_bytes = 512;
inline constexpr std::uint64_t block_bytes = 1 << 20;
inline constexpr std::uint64_t checkpoint_format = 1;

std::uint32_t crc32c(std::span<const std::byte> bytes);

struct Seal {
  std::uint64_t step = 0;
  double time = 0;  // s
  std::uint64_t file_bytes = 0;
  std::uint64_t manifest_place = 0, manifest_bytes = 0;
  std::uint32_t manifest_crc = 0, metadata_crc = 0;

  void write(const PosixFile& file) const;
  // Nothing, and why in `fault`, when the seal is missing, damaged or of another format.
  static std::optional<Seal> read(const PosixFile& file, std::string& fault);
};

struct ManifestEntry {
  std::string name;
  std::uint64_t place = 0, bytes = 0;      // in the file
  std::vector<std::uint32_t> checksums{};  // a block each; the last block may be short

  std::uint64_t blocks() const { return (bytes + block_bytes - 1) / block_bytes; }
  std::uint64_t block_size(std::uint64_t block) const;
};

struct Manifest {
  std::vector<ManifestEntry> entries;

  // One line an entry. The length of the text depends on names and lengths alone, not on places and checksums.
  std::string text() const;
  // Nothing unless every entry is well formed and lies within the file.
  static std::optional<Manifest> parse(std::string_view text, std::uint64_t file_bytes);
};

// The manifest of a file whose seal is good; nothing, and why in `fault`, when it is damaged.
std::optional<Manifest> read_manifest(const PosixFile& file, const Seal& seal, std::string& fault);

// CRC32C of all bytes that are neither seal nor manifest nor data. Throws Stop(checkpoint_corrupt) when places overlap or lie
// beyond the end.
std::uint32_t metadata_checksum(const PosixFile& file, const Seal& seal, const Manifest& manifest);

// Blocks part, part + parts, … of all datasets against their checksums; a line each that is wrong, with dataset and block.
std::vector<std::string> faulty_blocks(const PosixFile& file, const Manifest& manifest, int part = 0, int parts = 1);

// Raw checksums of a dataset of which only some bytes are known here and the rest count as zeros. CRC is linear over GF(2): the
// exclusive or over all ranks, each with its own bytes, is the raw checksum of the whole, and finish() makes it CRC32C.
class PartialChecksums {
 public:
  explicit PartialChecksums(std::uint64_t bytes);
  void add(std::span<const std::byte> run, std::uint64_t place);  // in ascending order of place
  const std::vector<std::uint32_t>& close();
  static std::uint32_t finish(std::uint32_t raw, std::uint64_t block_size);

 private:
  void feed(const std::byte* bytes, std::uint64_t until);

  std::uint64_t bytes_, done_ = 0;
  std::vector<std::uint32_t> raw_;
};

}  // namespace bedflow
