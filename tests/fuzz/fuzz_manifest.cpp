// Any bytes as a checkpoint's seal and manifest. The first byte chooses: the manifest's text; a text whose seal is good, in a
// file that is then checked block by block; or the file as it is.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

#include "checkpoint/posix_file.h"
#include "checkpoint/seal.h"

namespace {

using namespace bedflow;

void check(const PosixFile& file) {
  std::string fault;
  const auto seal = Seal::read(file, fault);
  if (!seal) {
    if (fault.empty()) std::abort();  // every refusal says why
    return;
  }
  const auto manifest = read_manifest(file, *seal, fault);
  if (!manifest) {
    if (fault.empty()) std::abort();
    return;
  }
  try {
    metadata_checksum(file, *seal, *manifest);
  } catch (const Stop&) {  // places that overlap, or lie beyond the end
  }
  faulty_blocks(file, *manifest);
}

void check_with_good_seal(std::string_view text) {
  const MemoryFile memory;
  const PosixFile file(memory.path(), PosixFile::Mode::write);
  const auto bytes = std::as_bytes(std::span(text));
  Seal seal;
  seal.manifest_place = seal_bytes;
  seal.manifest_bytes = text.size();
  seal.file_bytes = seal_bytes + text.size() + 4096;
  seal.manifest_crc = crc32c(bytes);
  seal.write(file);
  file.write(bytes, seal_bytes);
  const std::byte last{1};
  file.write(std::span(&last, 1), seal.file_bytes - 1);
  check(PosixFile(memory.path(), PosixFile::Mode::read));
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (data[0] == 's') {
    check_with_good_seal(bytes);
  } else if (data[0] == 'f') {
    const MemoryFile memory;
    PosixFile(memory.path(), PosixFile::Mode::write).write(std::as_bytes(std::span(bytes)), 0);
    check(PosixFile(memory.path(), PosixFile::Mode::read));
  } else if (const auto manifest = Manifest::parse(bytes, 1 << 30); manifest && manifest->text() != bytes && !bytes.empty()) {
    std::abort();  // what is taken is what would have been written
  }
  return 0;
}
