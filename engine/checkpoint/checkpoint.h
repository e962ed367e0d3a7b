// Checkpoints: one self-describing HDF5 file, complete and right to the bit or not there at all.
//
// The engine's state is handed over as named arrays; this module knows nothing of gas or particles. Layout, block checksums
// (CRC32C per MiB block of every array, in a manifest) and the order of writing are those of engine/README.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/stop.h"
#include "parallel/decomposition.h"

namespace bedflow {

// This rank's part of a global 3-D array (z slowest in the file, x fastest): shape of the whole, first index, count.
struct GridPart {
  Int3 global{}, first{}, count{};
};

// An array of the file. Grid arrays hold this rank's part, x fastest; row arrays hold this rank's rows, and the file holds
// all ranks' rows one after another with the offsets of the ranks beside them. Text arrays are rank 0's.
struct CheckpointArray {
  std::string name;     // e.g. "gas/pressure", "particles/position"
  std::string unit;     // SI
  std::string meaning;  // one line
  std::variant<std::vector<double>, std::vector<std::int64_t>, std::string> values;
  std::optional<GridPart> part;  // grid array
  int columns = 1;               // row array
};

struct CheckpointContent {
  std::uint64_t step = 0;
  double time = 0;                        // s
  std::map<std::string, double> numbers;  // attributes of the root: totals, time-step controller …
  std::vector<CheckpointArray> arrays;
};

struct CheckpointInfo {
  std::filesystem::path path;
  std::uint64_t step = 0;
  double time = 0;  // s
  std::uint64_t bytes = 0;
};

// Collective. Writes folder/checkpoint_<step, 10 digits>.h5 by way of ….partial (file_names.h, seal.h, layout.h): layout by rank
// 0, posix_fallocate, each rank its slabs by pwrite, fsync, manifest, fsync, verify, rename, fsync of the folder; then removes
// the oldest beyond `keep` (at least 2), and those of later steps, which a resume from an earlier one has made void. Throws Stop
// on every rank alike: disk_full when there is no room (older checkpoints stay), stale_epoch when the folder's newest attempt is
// above epoch (epoch 0: not checked), internal for other failures of the file system.
CheckpointInfo write_checkpoint(const Comm& comm, const std::filesystem::path& folder, const CheckpointContent& content, int keep,
                                std::uint32_t epoch = 0);

// Checks every block of a file against its manifest. Empty: good. Else names dataset and block, one line each.
std::vector<std::string> verify_checkpoint(const std::filesystem::path& path);

// The complete checkpoints of a folder, newest first, by name; nothing is read (time is 0).
std::vector<CheckpointInfo> list_checkpoints(const std::filesystem::path& folder);

// Newest checkpoint that verifies (rank 0 looks, all are told). What was wrong with newer ones is appended to `faults`.
std::optional<CheckpointInfo> newest_good_checkpoint(const Comm& comm, const std::filesystem::path& folder,
                                                     std::vector<std::string>& faults);

// A verified file, open for reading by all ranks.
class CheckpointReader {
 public:
  // Throws Stop(checkpoint_corrupt) naming dataset and block, on every rank alike.
  CheckpointReader(const Comm& comm, const std::filesystem::path& path);
  ~CheckpointReader();

  std::uint64_t step() const;
  double time() const;
  int ranks() const;  // that wrote it
  bool has_number(const std::string& name) const;
  double number(const std::string& name) const;
  bool has(const std::string& array) const;
  std::string text(const std::string& array) const;
  // The three below are collective. Part of the grid as asked for, x fastest; global must be the stored shape.
  std::vector<double> grid(const std::string& array, const GridPart& part) const;
  // Rows of this rank: as written if the number of ranks is the same, an even share of all rows otherwise.
  std::vector<double> rows(const std::string& array) const;
  std::vector<std::int64_t> integer_rows(const std::string& array) const;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace bedflow
