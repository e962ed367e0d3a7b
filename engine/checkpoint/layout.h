// How the arrays of all ranks lie in the datasets of a checkpoint file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "checkpoint/checkpoint.h"
#include "checkpoint/seal.h"

namespace bedflow {

// Bytes of this rank that lie side by side in a dataset, and where.
struct Run {
  std::span<const std::byte> bytes;
  std::uint64_t place = 0;  // bytes from the dataset's start
};

class Layout {
 public:
  // Collective. Throws Stop(internal) on every rank alike when an array's values do not fit its shape.
  Layout(const Comm& comm, const CheckpointContent& content);
  Layout(const Layout&) = delete;
  Layout& operator=(const Layout&) = delete;

  const std::vector<Dataset>& datasets() const { return datasets_; }
  // What this rank writes to a dataset, in ascending order of place. Points into the content and into this object.
  std::vector<Run> runs(std::size_t dataset) const;

  // Creates the file with every dataset allocated and every attribute written, and leaves it closed. For one rank alone.
  // Returns the datasets' places, checksums 0. seal: gets the file's length and the manifest's place.
  Manifest create(const std::filesystem::path& path, Seal& seal) const;

 private:
  struct Source {
    const CheckpointArray* array = nullptr;  // nothing for rank offsets
    std::uint64_t first_row = 0;             // of this rank, in a row array
    std::vector<std::int64_t> offsets{};     // of the ranks, in a rank offsets dataset
  };
  void add(const Comm& comm, const CheckpointArray& array);

  const CheckpointContent& content_;
  int ranks_;
  bool root_;
  std::vector<Dataset> datasets_;
  std::vector<Source> sources_;  // one a dataset
};

}  // namespace bedflow
