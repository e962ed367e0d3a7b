// A checkpoint's content with every kind of array, and a folder to write it to.
#pragma once

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "checkpoint/checkpoint.h"

namespace bedflow::test {

// Of all ranks; rank 0 makes it and takes it away again.
class SharedFolder {
 public:
  explicit SharedFolder(const Comm& comm) : comm_(comm) {
    std::string name = (std::filesystem::temp_directory_path() / "bedflow_checkpoint_XXXXXX").string();
    if (comm.root() && !::mkdtemp(name.data())) std::abort();
    path_ = comm.broadcast(name);
  }
  ~SharedFolder() {
    comm_.barrier();
    std::error_code ignored;
    if (comm_.root()) std::filesystem::remove_all(path_, ignored);
  }
  SharedFolder(const SharedFolder&) = delete;
  SharedFolder& operator=(const SharedFolder&) = delete;
  // <job>/checkpoints
  std::filesystem::path checkpoints() const { return path_ / "checkpoints"; }
  const std::filesystem::path& job() const { return path_; }

 private:
  Comm comm_;
  std::filesystem::path path_;
};

inline constexpr Int3 shape = {7, 9, 5};

// A value that no other cell has, with all its bits in use.
inline double cell_value(int i, int j, int k) {
  return std::sqrt(2.0 + i + 100.0 * j + 10000.0 * k);
}

inline GridPart part_of(const Comm& comm) {
  const Decomposition blocks(comm, shape, {0.7, 0.9, 0.5}, {false, false, false});
  return {shape, blocks.first(), blocks.cells()};
}

inline std::vector<double> cells_of(const GridPart& part) {
  std::vector<double> values;
  for (int k = 0; k < part.count[2]; ++k)
    for (int j = 0; j < part.count[1]; ++j)
      for (int i = 0; i < part.count[0]; ++i)
        values.push_back(cell_value(part.first[0] + i, part.first[1] + j, part.first[2] + k));
  return values;
}

// Rank r has 3 r + 2 rows (none on rank 2): numbered through, with their global number as the value of column 0.
inline std::int64_t rows_on(int rank) {
  return rank == 2 ? 0 : 3 * rank + 2;
}

// extra: how many values more in a row array of rank 0, to reach several blocks.
inline CheckpointContent content_of(const Comm& comm, std::uint64_t step = 42, std::size_t extra = 0) {
  CheckpointContent content;
  content.step = step;
  content.time = 0.1 * static_cast<double>(step);
  content.numbers = {{"domain/size_x", 0.7}, {"totals/mass", 1.0 / 3.0}};
  const GridPart part = part_of(comm);
  content.arrays.push_back({"gas/pressure", "Pa", "gas pressure at the cells' centres", cells_of(part), part, 1});
  const std::int64_t rows = rows_on(comm.rank()), before = comm.sum_before(rows);
  std::vector<double> position;
  std::vector<std::int64_t> id;
  for (std::int64_t row = before; row < before + rows; ++row) {
    for (int d = 0; d < 3; ++d) position.push_back(std::sqrt(static_cast<double>(3 * row + d) + 0.5));
    id.push_back(1000 - row);
  }
  content.arrays.push_back({"particles/position", "m", "centres, three columns", position, std::nullopt, 3});
  content.arrays.push_back({"particles/id", "1", "identity", id, std::nullopt, 1});
  content.arrays.push_back({"contacts/none", "m", "an empty array", std::vector<double>{}, std::nullopt, 3});
  content.arrays.push_back(
      {"case", "1", "effective case, text format", std::string("particles {\n  count: 9240  # µ\n}\n"), std::nullopt, 1});
  if (extra > 0) {
    std::vector<double> many(comm.root() ? extra : 1);
    for (std::size_t i = 0; i < many.size(); ++i) many[i] = std::sin(1.0 + static_cast<double>(i));
    content.arrays.push_back({"statistics/bins", "1", "many values", many, std::nullopt, 1});
  }
  return content;
}

}  // namespace bedflow::test
