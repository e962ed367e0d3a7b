// Writing: layout -> room -> slabs -> fsync -> manifest and seal -> fsync -> verify -> epoch -> rename -> fsync of the folder.
#include <algorithm>
#include <cstring>
#include <optional>

#include "checkpoint/agree.h"
#include "checkpoint/checkpoint.h"
#include "checkpoint/file_names.h"
#include "checkpoint/layout.h"

namespace bedflow {

namespace fs = std::filesystem;

namespace {

// Writes what this rank has of every dataset, and sums it up: raw checksums, dataset by dataset, block by block.
std::vector<std::uint32_t> write_slabs(const fs::path& path, const Layout& layout, const Manifest& manifest) {
  const PosixFile file(path, PosixFile::Mode::write);
  std::vector<std::uint32_t> raw;
  for (std::size_t i = 0; i < manifest.entries.size(); ++i) {
    PartialChecksums sums(manifest.entries[i].bytes);
    for (const Run& run : layout.runs(i)) {
      file.write(run.bytes, manifest.entries[i].place + run.place);
      sums.add(run.bytes, run.place);
    }
    const std::vector<std::uint32_t>& blocks = sums.close();
    raw.insert(raw.end(), blocks.begin(), blocks.end());
  }
  file.sync();
  return raw;
}

// Joins the checksums of all ranks; on rank 0 the manifest is complete then.
void join_checksums(const Comm& comm, const std::vector<std::uint32_t>& mine, Manifest& manifest) {
  const std::vector<std::byte> all = comm.gather(std::as_bytes(std::span(mine)));
  if (!comm.root()) return;
  std::vector<std::uint32_t> joined(mine.size(), 0);
  for (std::size_t i = 0; i < all.size() / 4; ++i) {
    std::uint32_t raw = 0;
    std::memcpy(&raw, all.data() + 4 * i, 4);
    joined[i % joined.size()] ^= raw;
  }
  auto raw = joined.begin();
  for (ManifestEntry& entry : manifest.entries)
    for (std::uint64_t block = 0; block < entry.blocks(); ++block)
      entry.checksums[block] = PartialChecksums::finish(*raw++, entry.block_size(block));
}

void write_seal(const fs::path& path, const Manifest& manifest, Seal& seal) {
  const PosixFile file(path, PosixFile::Mode::write);
  const std::string text = manifest.text();
  seal.manifest_crc = crc32c(std::as_bytes(std::span(text)));
  seal.metadata_crc = metadata_checksum(file, seal, manifest);
  file.write(std::as_bytes(std::span(text)), seal.manifest_place);
  seal.write(file);
  file.sync();
}

// Reads back: this rank's share of the blocks, and on rank 0 seal, manifest and metadata too.
void read_back(const Comm& comm, const fs::path& path, const Manifest& manifest) {
  const PosixFile file(path, PosixFile::Mode::read);
  std::vector<std::string> faults = faulty_blocks(file, manifest, comm.rank(), comm.size());
  std::string fault;
  if (comm.root()) {
    const std::optional<Seal> seal = Seal::read(file, fault);
    if (!seal || !read_manifest(file, *seal, fault)) faults.push_back(fault);
    if (seal && metadata_checksum(file, *seal, manifest) != seal->metadata_crc) faults.push_back("metadata: checksum");
  }
  if (!faults.empty()) throw Stop(Reason::internal, path.string() + " does not read back as it was written: " + faults.front());
}

void check_epoch(const fs::path& folder, std::uint32_t epoch) {
  const std::uint64_t newest = epoch == 0 ? 0 : newest_attempt(folder.parent_path());
  if (newest > epoch) {
    throw Stop(Reason::stale_epoch, "attempt " + std::to_string(newest) + " has taken this job over from attempt " +
                                        std::to_string(epoch) + ": no checkpoint was left behind");
  }
}

// Beyond the newest up to this step, what is too many; those of later steps, which a resume from an earlier one has made void;
// and what this attempt or one before it left unfinished. Not being able to remove is no failure.
void prune(const fs::path& folder, std::uint64_t step, int keep, std::uint32_t epoch) {
  std::error_code ignored;
  int kept = 0;
  for (const CheckpointInfo& info : list_checkpoints(folder))
    if (info.step > step || ++kept > std::max(keep, 2)) fs::remove(info.path, ignored);
  std::vector<fs::path> torn;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::optional<std::uint32_t> attempt = attempt_of_partial(entry.path());
    if (attempt && *attempt <= epoch) torn.push_back(entry.path());
  }
  for (const fs::path& path : torn) fs::remove(path, ignored);
}

}  // namespace

CheckpointInfo write_checkpoint(const Comm& comm, const fs::path& folder_given, const CheckpointContent& content, int keep,
                                std::uint32_t epoch) {
  fs::path folder = fs::absolute(folder_given).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  const fs::path target = folder / checkpoint_name(content.step), partial = folder / partial_name(content.step, epoch);
  const Layout layout(comm, content);
  Seal seal{content.step, content.time};
  try {
    Manifest manifest;
    std::string text;
    do_alike(comm, [&] {
      if (!comm.root()) return;
      fs::create_directories(folder);
      manifest = layout.create(partial, seal);
      text = manifest.text();
    });
    text = comm.broadcast(text);
    std::vector<std::uint32_t> raw;
    do_alike(comm, [&] {
      if (!comm.root()) manifest = Manifest::parse(text, UINT64_MAX).value();
      raw = write_slabs(partial, layout, manifest);
    });
    join_checksums(comm, raw, manifest);
    do_alike(comm, [&] {
      if (!comm.root()) return;
      write_seal(partial, manifest, seal);
      text = manifest.text();
    });
    text = comm.broadcast(text);
    do_alike(comm, [&] { read_back(comm, partial, Manifest::parse(text, UINT64_MAX).value()); });
    do_alike(comm, [&] {
      if (!comm.root()) return;
      check_epoch(folder, epoch);
      rename_for_good(partial, target);
      prune(folder, content.step, keep, epoch);
    });
  } catch (const Stop&) {
    std::error_code ignored;
    if (comm.root()) fs::remove(partial, ignored);
    throw;
  }
  CheckpointInfo info{target, content.step, content.time, seal.file_bytes};
  comm.broadcast(std::as_writable_bytes(std::span(&info.bytes, 1)));
  return info;
}

}  // namespace bedflow
