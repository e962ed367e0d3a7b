#include "checkpoint/seal.h"

#include <isa-l/crc.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <iomanip>
#include <sstream>

namespace bedflow {

namespace {

static_assert(std::endian::native == std::endian::little, "checkpoints are little-endian");

constexpr std::string_view magic = "bedflow checkpoint\n";
constexpr std::string_view manifest_title = "bedflow manifest: dataset, place, bytes, CRC32C of each block of 1048576 bytes";

// The seal's bytes before its own checksum.
struct SealBytes {
  std::array<char, 24> magic{};
  std::uint64_t format = checkpoint_format, step = 0;
  double time = 0;
  std::uint64_t file_bytes = 0, manifest_place = 0, manifest_bytes = 0;
  std::uint32_t manifest_crc = 0, metadata_crc = 0;
};
static_assert(sizeof(SealBytes) == 80);

std::uint32_t raw_crc(const std::byte* bytes, std::uint64_t count, std::uint32_t so_far) {
  // ISA-L reads only, its signature lacks the const; no caller passes more than a block or a manifest.
  auto* data = reinterpret_cast<unsigned char*>(const_cast<std::byte*>(bytes));
  constexpr std::uint64_t most = 1 << 30;
  for (; count > most; count -= most, data += most) so_far = crc32_iscsi(data, static_cast<int>(most), so_far);
  return crc32_iscsi(data, static_cast<int>(count), so_far);
}

const std::vector<std::byte>& zeros() {
  static const std::vector<std::byte> block(block_bytes);
  return block;
}

template <class Number>
bool take_hex(std::string_view& line, std::size_t digits, Number& number) {
  if (line.size() < digits + 1 || line[0] != ' ') return false;
  if (line.substr(1, digits).find_first_not_of("0123456789abcdef") != std::string_view::npos) return false;  // as it is written
  const char* const first = line.data() + 1;
  const auto [end, error] = std::from_chars(first, first + digits, number, 16);
  line.remove_prefix(digits + 1);
  return error == std::errc() && end == first + digits;
}

}  // namespace

std::uint32_t crc32c(std::span<const std::byte> bytes) {
  return ~raw_crc(bytes.data(), bytes.size(), 0xffffffffU);
}

void Seal::write(const PosixFile& file) const {
  SealBytes seal;
  std::copy(magic.begin(), magic.end(), seal.magic.begin());
  seal.step = step;
  seal.time = time;
  seal.file_bytes = file_bytes;
  seal.manifest_place = manifest_place;
  seal.manifest_bytes = manifest_bytes;
  seal.manifest_crc = manifest_crc;
  seal.metadata_crc = metadata_crc;
  std::array<std::byte, seal_bytes> bytes{};
  std::memcpy(bytes.data(), &seal, sizeof(seal));
  const std::uint32_t own = crc32c(std::span(bytes).first(seal_bytes - 4));
  std::memcpy(bytes.data() + seal_bytes - 4, &own, 4);
  file.write(bytes, 0);
}

std::optional<Seal> Seal::read(const PosixFile& file, std::string& fault) {
  std::array<std::byte, seal_bytes> bytes{};
  const std::size_t got = file.read(bytes, 0);
  SealBytes seal;
  std::memcpy(&seal, bytes.data(), sizeof(seal));
  std::uint32_t own = 0;
  std::memcpy(&own, bytes.data() + seal_bytes - 4, 4);
  const bool ours = std::equal(magic.begin(), magic.end(), seal.magic.begin());
  if (got < seal_bytes) {
    fault = "not a checkpoint: only " + std::to_string(got) + " bytes long";
  } else if (own != crc32c(std::span(bytes).first(seal_bytes - 4))) {
    const bool empty = std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0}; });
    fault = ours    ? "seal (the first 512 bytes): checksum does not match, bytes were changed"
            : empty ? "seal (the first 512 bytes): all zeros, the file was never completed or was overwritten"
                    : "not a checkpoint of bedflow: no seal in its first 512 bytes";
  } else if (!ours || seal.format != checkpoint_format) {
    fault = "seal: format " + std::to_string(seal.format) + ", this program reads format " + std::to_string(checkpoint_format);
  } else {
    return Seal{seal.step,           seal.time,         seal.file_bytes,  seal.manifest_place,
                seal.manifest_bytes, seal.manifest_crc, seal.metadata_crc};
  }
  return std::nullopt;
}

std::uint64_t ManifestEntry::block_size(std::uint64_t block) const {
  return std::min(block_bytes, bytes - block * block_bytes);
}

std::string Manifest::text() const {
  std::ostringstream out;
  out << manifest_title << "\n" << std::hex << std::setfill('0');
  for (const ManifestEntry& entry : entries) {
    out << entry.name << " " << std::setw(16) << entry.place << " " << std::setw(16) << entry.bytes;
    for (std::uint32_t checksum : entry.checksums) out << " " << std::setw(8) << checksum;
    out << "\n";
  }
  return out.str();
}

std::optional<Manifest> Manifest::parse(std::string_view text, std::uint64_t file_bytes) {
  Manifest manifest;
  for (bool title = true; !text.empty(); title = false) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    if (title && line != manifest_title) return std::nullopt;
    if (title) continue;
    ManifestEntry entry;
    entry.name = line.substr(0, line.find(' '));
    line.remove_prefix(entry.name.size());
    if (!take_hex(line, 16, entry.place) || !take_hex(line, 16, entry.bytes)) return std::nullopt;
    if (entry.place > file_bytes || entry.bytes > file_bytes - entry.place) return std::nullopt;
    if (line.size() != 9 * entry.blocks()) return std::nullopt;
    entry.checksums.resize(entry.blocks());
    for (std::uint32_t& checksum : entry.checksums)
      if (!take_hex(line, 8, checksum)) return std::nullopt;
    manifest.entries.push_back(std::move(entry));
  }
  return manifest;
}

std::optional<Manifest> read_manifest(const PosixFile& file, const Seal& seal, std::string& fault) {
  const std::uint64_t length = file.bytes();
  if (seal.manifest_place > length || seal.manifest_bytes > length - seal.manifest_place) {
    fault = "manifest: beyond the end of the file";
    return std::nullopt;
  }
  std::string text(seal.manifest_bytes, '\0');
  file.read(std::as_writable_bytes(std::span(text)), seal.manifest_place);
  if (crc32c(std::as_bytes(std::span(text))) != seal.manifest_crc) {
    fault = "manifest: checksum does not match, bytes were changed";
    return std::nullopt;
  }
  std::optional<Manifest> manifest = Manifest::parse(text, seal.file_bytes);
  if (!manifest) fault = "manifest: not well formed";
  return manifest;
}

std::uint32_t metadata_checksum(const PosixFile& file, const Seal& seal, const Manifest& manifest) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> known = {
      {0, seal_bytes}, {seal.manifest_place, seal.manifest_bytes}, {seal.file_bytes, 0}};
  for (const ManifestEntry& entry : manifest.entries)
    if (entry.bytes > 0) known.emplace_back(entry.place, entry.bytes);
  std::sort(known.begin(), known.end());
  std::uint32_t crc = 0xffffffffU;
  std::uint64_t done = 0;
  std::vector<std::byte> buffer(block_bytes);
  for (const auto& [place, bytes] : known) {
    if (place < done) throw Stop(Reason::checkpoint_corrupt, file.path().string() + ": datasets overlap");
    while (done < place) {
      const std::size_t count = std::min(block_bytes, place - done);
      if (file.read(std::span(buffer).first(count), done) < count)
        throw Stop(Reason::checkpoint_corrupt, file.path().string() + ": cut short");
      crc = raw_crc(buffer.data(), count, crc);
      done += count;
    }
    done = place + bytes;
  }
  return ~crc;
}

std::vector<std::string> faulty_blocks(const PosixFile& file, const Manifest& manifest, int part, int parts) {
  std::vector<std::string> faults;
  std::vector<std::byte> buffer(block_bytes);
  std::uint64_t turn = 0;
  for (const ManifestEntry& entry : manifest.entries) {
    for (std::uint64_t block = 0; block < entry.blocks(); ++block, ++turn) {
      if (turn % static_cast<std::uint64_t>(parts) != static_cast<std::uint64_t>(part)) continue;
      const auto bytes = std::span(buffer).first(entry.block_size(block));
      const std::size_t got = file.read(bytes, entry.place + block * block_bytes);
      const std::string name = entry.name + " block " + std::to_string(block) + ": ";
      if (got < bytes.size()) {
        faults.push_back(name + "cut off, " + std::to_string(got) + " of " + std::to_string(bytes.size()) + " bytes are there");
      } else if (const std::uint32_t crc = crc32c(bytes); crc != entry.checksums[block]) {
        std::ostringstream text;
        text << name << "checksum " << std::hex << std::setfill('0') << std::setw(8) << crc << ", the manifest says "
             << std::setw(8) << entry.checksums[block];
        const bool empty = std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0}; });
        faults.push_back(text.str() + (empty ? "; all zeros" : ""));
      }
    }
  }
  return faults;
}

PartialChecksums::PartialChecksums(std::uint64_t bytes) : bytes_(bytes), raw_((bytes + block_bytes - 1) / block_bytes, 0) {}

// Takes bytes (zeros when null) up to `until`, block by block. A raw checksum of 0 stays 0 through zeros.
void PartialChecksums::feed(const std::byte* bytes, std::uint64_t until) {
  while (done_ < until) {
    const std::uint64_t block = done_ / block_bytes;
    const std::uint64_t count = std::min(until, (block + 1) * block_bytes) - done_;
    std::uint32_t& raw = raw_[block];
    if (bytes || raw != 0) raw = raw_crc(bytes ? bytes : zeros().data(), count, raw);
    if (bytes) bytes += count;
    done_ += count;
  }
}

void PartialChecksums::add(std::span<const std::byte> run, std::uint64_t place) {
  feed(nullptr, place);
  feed(run.data(), place + run.size());
}

const std::vector<std::uint32_t>& PartialChecksums::close() {
  feed(nullptr, bytes_);
  return raw_;
}

std::uint32_t PartialChecksums::finish(std::uint32_t raw, std::uint64_t block_size) {
  return raw ^ crc32c(std::span(zeros()).first(block_size));
}

}  // namespace bedflow
