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
  // Of a row array that one rank writes as it was written by many (CheckpointContent::ranks): their first rows, and the end.
  std::vector<std::int64_t> rank_offsets = {};
};

// An array as it lies in a file. Grid arrays have the shape (z, y, x), row arrays (rows, columns) or (rows), text arrays (bytes).
// A row array is followed by "rank_offsets/<name>": the first row of each rank, and the number of all rows.
struct Dataset {
  enum class Type { real, integer, byte };
  std::string name, unit, meaning;
  Type type = Type::real;
  std::vector<std::uint64_t> shape;
};

struct CheckpointContent {
  std::uint64_t step = 0;
  double time = 0;                        // s
  std::map<std::string, double> numbers;  // attributes of the root: totals, time-step controller …
  std::vector<CheckpointArray> arrays;
  int ranks = 0;  // that it is of; 0: those that write it
};

struct CheckpointInfo {
  std::filesystem::path path;
  std::uint64_t step = 0;
  double time = 0;  // s
  std::uint64_t bytes = 0;
  std::vector<std::uint64_t> removed = {};  // steps of those that were removed for it; on rank 0
};

// How many of the newest stay (at least 2), and whether the one that is written stays when newer ones come.
struct KeepCheckpoints {
  KeepCheckpoints(int newest_ones, bool this_one_too = false) : newest(newest_ones), this_one(this_one_too) {}
  int newest;
  bool this_one;
};

// Collective. Writes folder/checkpoint_<step, 10 digits>.h5 by way of ….partial (file_names.h, seal.h, layout.h): layout by rank
// 0, posix_fallocate, the slabs by pwrite, fsync, manifest, fsync, verify, rename, fsync of the folder; then removes
// what is not to be kept, but for what is pinned, and those of later steps, which a resume from an earlier one has made void.
// one_writer: rank 0 writes the slabs of all, to the same bits. Absent: where ranks of several machines meet on NFS or SMB, whose
// clients write whole pages, so that two with bytes in one page may undo each other's.
// Throws Stop on every rank alike: disk_full when there is no room (older checkpoints stay), stale_epoch when the folder's newest
// attempt is above epoch (epoch 0: not checked), internal for other failures of the file system.
CheckpointInfo write_checkpoint(const Comm& comm, const std::filesystem::path& folder, const CheckpointContent& content,
                                KeepCheckpoints keep, std::uint32_t epoch = 0, std::optional<bool> one_writer = {});

// Checks every block of a file against its manifest. Empty: good. Else names dataset and block, one line each.
std::vector<std::string> verify_checkpoint(const std::filesystem::path& path);

// The complete checkpoints of a folder, newest first, by name; nothing is read (time is 0).
std::vector<CheckpointInfo> list_checkpoints(const std::filesystem::path& folder);

// Newest checkpoint that verifies (rank 0 looks, all are told). What was wrong with newer ones is appended to `faults`.
std::optional<CheckpointInfo> newest_good_checkpoint(const Comm& comm, const std::filesystem::path& folder,
                                                     std::vector<std::string>& faults);

// Of a file's blocks: all before anything is read, or those of an array when it is read.
enum class Verified { whole, as_read };

// What a state is restored from: a file, or the content that the ranks still hold (held_checkpoint.h).
class CheckpointSource {
 public:
  virtual ~CheckpointSource() = default;
  virtual std::uint64_t step() const = 0;
  virtual double time() const = 0;
  virtual int ranks() const = 0;  // that made it
  virtual double number(const std::string& name) const = 0;
  virtual bool has(const std::string& array) const = 0;
  // The three below are collective. Part of the grid as asked for, x fastest; global must be the stored shape.
  virtual std::vector<double> grid(const std::string& array, const GridPart& part) const = 0;
  // Rows of this rank: as they were given if the number of ranks is the same, an even share of all rows otherwise.
  virtual std::vector<double> rows(const std::string& array) const = 0;
  virtual std::vector<std::int64_t> integer_rows(const std::string& array) const = 0;
};

// A verified file, open for reading by all ranks.
class CheckpointReader : public CheckpointSource {
 public:
  // Throws Stop(checkpoint_corrupt) naming dataset and block, on every rank alike; with as_read, reading does too.
  CheckpointReader(const Comm& comm, const std::filesystem::path& path, Verified verified = Verified::whole);
  ~CheckpointReader() override;

  std::uint64_t step() const override;
  double time() const override;
  int ranks() const override;
  bool has_number(const std::string& name) const;
  double number(const std::string& name) const override;
  std::map<std::string, double> numbers() const;
  // What lies there, each as the manifest has it; in the manifest's order. Throws Stop(checkpoint_corrupt) for a dataset that is
  // not plain numbers side by side where and as long as the manifest says.
  std::vector<Dataset> datasets() const;
  bool has(const std::string& array) const override;
  std::string text(const std::string& array) const;
  std::vector<double> grid(const std::string& array, const GridPart& part) const override;
  std::vector<double> rows(const std::string& array) const override;
  std::vector<std::int64_t> integer_rows(const std::string& array) const override;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace bedflow
