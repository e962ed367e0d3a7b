// Writing: layout -> room -> slabs -> fsync -> manifest and seal -> fsync -> verify -> epoch -> rename -> fsync of the folder.
#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "checkpoint/agree.h"
#include "checkpoint/checkpoint.h"
#include "checkpoint/file_names.h"
#include "checkpoint/layout.h"

namespace bedflow {

namespace fs = std::filesystem;

namespace {

// Of what this rank has: raw checksums, dataset by dataset, block by block.
std::vector<std::uint32_t> checksums_of(const Layout& layout, const Manifest& manifest) {
  std::vector<std::uint32_t> raw;
  for (std::size_t i = 0; i < manifest.entries.size(); ++i) {
    PartialChecksums sums(manifest.entries[i].bytes);
    for (const Run& run : layout.runs(i)) sums.add(run.bytes, run.place);
    const std::vector<std::uint32_t>& blocks = sums.close();
    raw.insert(raw.end(), blocks.begin(), blocks.end());
  }
  return raw;
}

// Each rank what it has.
void write_slabs(const fs::path& path, const Layout& layout, const Manifest& manifest) {
  const PosixFile file(path, PosixFile::Mode::write);
  for (std::size_t i = 0; i < manifest.entries.size(); ++i) {
    for (const Run& run : layout.runs(i)) file.write(run.bytes, manifest.entries[i].place + run.place);
  }
  file.sync();
}

// What of the runs lies from `first` on and before `end`, as messages: place from `first` on, length (8 bytes each), bytes.
std::vector<std::byte> pieces(const std::vector<Run>& runs, std::uint64_t first, std::uint64_t end) {
  std::vector<std::byte> message;
  for (const Run& run : runs) {
    const std::uint64_t from = std::max(run.place, first), to = std::min(run.place + run.bytes.size(), end);
    if (from >= to) continue;
    const std::array<std::uint64_t, 2> head = {from - first, to - from};
    const auto bytes = run.bytes.subspan(from - run.place, to - from);
    message.insert(message.end(), std::as_bytes(std::span(head)).begin(), std::as_bytes(std::span(head)).end());
    message.insert(message.end(), bytes.begin(), bytes.end());
  }
  return message;
}

std::vector<std::byte> joined(std::span<const std::byte> messages, std::uint64_t bytes) {
  std::vector<std::byte> whole(bytes);
  std::array<std::uint64_t, 2> head{};
  while (!messages.empty()) {
    std::memcpy(head.data(), messages.data(), sizeof(head));
    std::memcpy(whole.data() + head[0], messages.data() + sizeof(head), head[1]);
    messages = messages.subspan(sizeof(head) + head[1]);
  }
  return whole;
}

// Collective. Rank 0 what all have, a block at a time, so that it never holds more of the others' than that.
void write_for_all(const Comm& comm, const fs::path& path, const Layout& layout, const Manifest& manifest) {
  std::optional<PosixFile> file;
  do_alike(comm, [&] {
    if (comm.root()) file.emplace(path, PosixFile::Mode::write);
  });
  for (std::size_t i = 0; i < manifest.entries.size(); ++i) {
    const ManifestEntry& entry = manifest.entries[i];
    const std::vector<Run> runs = layout.runs(i);
    for (std::uint64_t block = 0; block < entry.blocks(); ++block) {
      const std::uint64_t first = block * block_bytes, bytes = entry.block_size(block);
      const std::vector<std::byte> messages = comm.gather(pieces(runs, first, first + bytes));
      do_alike(comm, [&] {
        if (file) file->write(joined(messages, bytes), entry.place + first);
      });
    }
  }
  do_alike(comm, [&] {
    if (file) file->sync();
  });
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

// Removes, beyond the newest up to this step, what neither the policy nor a pin keeps; those of later steps, which a resume from
// an earlier one has made void; and what this attempt or one before it left unfinished. Not being able to remove is no failure.
std::vector<std::uint64_t> prune(const fs::path& folder, std::uint64_t step, int newest, std::uint32_t epoch) {
  std::error_code ignored;
  std::vector<std::uint64_t> removed;
  int kept = 0;
  for (const CheckpointInfo& info : list_checkpoints(folder)) {
    const fs::path mark = folder / kept_name(info.step), pin = folder.parent_path() / "pinned" / info.path.filename();
    const bool is_void = info.step > step;
    if (!is_void && ++kept <= std::max(newest, 2)) continue;
    if (!is_void && (fs::exists(mark, ignored) || fs::exists(pin, ignored))) continue;
    if (fs::remove(info.path, ignored)) removed.push_back(info.step);
    if (is_void) fs::remove(mark, ignored);
  }
  std::vector<fs::path> torn;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::optional<std::uint32_t> attempt = attempt_of_partial(entry.path());
    if (attempt && *attempt <= epoch) torn.push_back(entry.path());
  }
  for (const fs::path& path : torn) fs::remove(path, ignored);
  return removed;
}

// Not being able to leave it is no failure: the checkpoint then goes with the others.
void mark_as_kept(const fs::path& mark) {
  try {
    const PosixFile file(mark, PosixFile::Mode::create);
  } catch (const std::exception&) {
  }
}

}  // namespace

CheckpointInfo write_checkpoint(const Comm& comm, const fs::path& folder_given, const CheckpointContent& content,
                                KeepCheckpoints keep, std::uint32_t epoch, std::optional<bool> one_writer) {
  fs::path folder = fs::absolute(folder_given).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  const fs::path target = folder / checkpoint_name(content.step), partial = folder / partial_name(content.step, epoch);
  const Layout layout(comm, content);
  Seal seal{content.step, content.time};
  std::vector<std::uint64_t> removed;
  try {
    Manifest manifest;
    std::string text;
    bool on_network = false;
    do_alike(comm, [&] {
      if (!comm.root()) return;
      fs::create_directory(folder);  // not the job's folder, should somebody have removed it
      on_network = is_on_network_disk(folder);
      manifest = layout.create(partial, seal);
      text = manifest.text();
    });
    text = comm.broadcast(text);
    const bool by_one = one_writer ? *one_writer : comm.machines() > 1 && comm.any(on_network);
    std::vector<std::uint32_t> raw;
    do_alike(comm, [&] {
      if (!comm.root()) manifest = Manifest::parse(text, UINT64_MAX).value();
      raw = checksums_of(layout, manifest);
      if (!by_one) write_slabs(partial, layout, manifest);
    });
    if (by_one) write_for_all(comm, partial, layout, manifest);
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
      if (keep.this_one) mark_as_kept(folder / kept_name(content.step));
      rename_for_good(partial, target);
      removed = prune(folder, content.step, keep.newest, epoch);
    });
  } catch (const Stop&) {
    std::error_code ignored;
    if (comm.root()) fs::remove(partial, ignored);
    throw;
  }
  CheckpointInfo info{target, content.step, content.time, seal.file_bytes, std::move(removed)};
  comm.broadcast(std::as_writable_bytes(std::span(&info.bytes, 1)));
  return info;
}

}  // namespace bedflow
