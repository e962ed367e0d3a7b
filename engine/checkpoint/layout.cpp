#include "checkpoint/layout.h"

#include <numeric>

#include "checkpoint/agree.h"
#include "checkpoint/hdf5_file.h"

namespace bedflow {

namespace {

std::span<const std::byte> bytes_of(const CheckpointArray& array) {
  return std::visit([](const auto& values) { return std::as_bytes(std::span(values)); }, array.values);
}

std::uint64_t bytes_of(const Dataset& dataset) {
  const std::uint64_t size = dataset.type == Dataset::Type::byte ? 1 : 8;
  return std::accumulate(dataset.shape.begin(), dataset.shape.end(), size, std::multiplies<>());
}

hid_t hdf5_type(Dataset::Type type) {
  return type == Dataset::Type::real ? H5T_NATIVE_DOUBLE : type == Dataset::Type::integer ? H5T_NATIVE_INT64 : H5T_NATIVE_UINT8;
}

// Our own mistakes, named before they become a wrong file.
void check_fits(const CheckpointArray& array) {
  const auto wrong = [&](const char* what) { throw Stop(Reason::internal, "checkpoint array " + array.name + ": " + what); };
  if (array.name.empty() || array.name.find_first_of(" \n") != std::string::npos) wrong("its name is empty or has a space");
  if (std::holds_alternative<std::string>(array.values)) return;
  const std::size_t values = bytes_of(array).size() / 8;
  if (array.columns < 1 || values % static_cast<std::size_t>(array.columns) != 0) wrong("its values do not fill its rows");
  if (!array.part) return;
  std::size_t cells = 1;
  for (int d = 0; d < 3; ++d) {
    const GridPart& part = *array.part;
    if (part.first[d] < 0 || part.count[d] < 0 || part.first[d] + part.count[d] > part.global[d])
      wrong("its part is outside the grid");
    cells *= static_cast<std::size_t>(part.count[d]);
  }
  if (values != cells) wrong("its values do not fill its part of the grid");
}

// Lines along x, joined where the part spans the grid.
std::vector<Run> grid_runs(const GridPart& part, std::span<const std::byte> bytes) {
  std::vector<Run> runs;
  const std::size_t line = static_cast<std::size_t>(part.count[0]) * 8;
  if (bytes.empty()) return runs;
  for (int k = 0; k < part.count[2]; ++k) {
    for (int j = 0; j < part.count[1]; ++j, bytes = bytes.subspan(line)) {
      const std::uint64_t row = static_cast<std::uint64_t>(part.first[2] + k) * part.global[1] + (part.first[1] + j);
      const std::uint64_t place = (row * part.global[0] + part.first[0]) * 8;
      if (!runs.empty() && runs.back().place + runs.back().bytes.size() == place) {
        runs.back().bytes = {runs.back().bytes.data(), runs.back().bytes.size() + line};
      } else {
        runs.push_back({bytes.first(line), place});
      }
    }
  }
  return runs;
}

}  // namespace

Layout::Layout(const Comm& comm, const CheckpointContent& content)
    : content_(content), ranks_(content.ranks > 0 ? content.ranks : comm.size()), root_(comm.root()) {
  do_alike(comm, [&] {
    for (const CheckpointArray& array : content.arrays) check_fits(array);
  });
  const auto arrays = static_cast<std::int64_t>(content.arrays.size());
  if (comm.max(arrays) + comm.max(-arrays) != 0) throw Stop(Reason::internal, "the ranks hand over different checkpoint arrays");
  for (const CheckpointArray& array : content.arrays) add(comm, array);
}

void Layout::add(const Comm& comm, const CheckpointArray& array) {
  Dataset dataset{array.name, array.unit, array.meaning, Dataset::Type::real, {}};
  const auto columns = static_cast<std::uint64_t>(array.columns);
  if (std::holds_alternative<std::vector<std::int64_t>>(array.values)) dataset.type = Dataset::Type::integer;
  if (array.part) {
    for (int d = 2; d >= 0; --d) dataset.shape.push_back(static_cast<std::uint64_t>(array.part->global[d]));
    datasets_.push_back(dataset);
    sources_.push_back({&array});
    return;
  }
  const bool text = std::holds_alternative<std::string>(array.values);
  const std::size_t mine = text ? (root_ ? bytes_of(array).size() : 0) : bytes_of(array).size() / 8 / columns;
  std::vector<std::int64_t> offsets = comm.gather_all(static_cast<std::int64_t>(mine));
  offsets.insert(offsets.begin(), 0);
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  const auto rows = static_cast<std::uint64_t>(offsets.back());
  const auto first_row = static_cast<std::uint64_t>(offsets[comm.rank()]);
  if (!array.rank_offsets.empty()) offsets = array.rank_offsets;
  if (text) dataset.type = Dataset::Type::byte;
  dataset.shape = {rows};
  if (columns > 1) dataset.shape.push_back(columns);
  datasets_.push_back(dataset);
  sources_.push_back({&array, first_row});
  if (text) return;
  datasets_.push_back({"rank_offsets/" + array.name,
                       "1",
                       "first row of each rank in " + array.name + ", and the number of rows",
                       Dataset::Type::integer,
                       {offsets.size()}});
  sources_.push_back({nullptr, 0, std::move(offsets)});
}

std::vector<Run> Layout::runs(std::size_t dataset) const {
  const Source& source = sources_[dataset];
  if (!source.array) return root_ ? std::vector<Run>{{std::as_bytes(std::span(source.offsets)), 0}} : std::vector<Run>{};
  const std::span<const std::byte> bytes = bytes_of(*source.array);
  if (source.array->part) return grid_runs(*source.array->part, bytes);
  const bool text = datasets_[dataset].type == Dataset::Type::byte;
  if (bytes.empty() || (text && !root_)) return {};
  return {{bytes, source.first_row * (text ? 1 : 8 * static_cast<std::uint64_t>(source.array->columns))}};
}

Manifest Layout::create(const std::filesystem::path& path, Seal& seal) const {
  Manifest manifest;
  std::uint64_t total = 0;
  for (const Dataset& dataset : datasets_) {
    ManifestEntry entry{dataset.name, 0, bytes_of(dataset)};
    entry.checksums.resize(entry.blocks());
    total += entry.bytes;
    manifest.entries.push_back(std::move(entry));
  }
  seal.manifest_bytes = manifest.text().size();
  constexpr std::uint64_t metadata_a_dataset = 4096;  // far more than its header and attributes take
  check_room(path.parent_path(), total + seal.manifest_bytes + metadata_a_dataset * (datasets_.size() + 4));

  MemoryFile memory;  // the arrays are holes in it
  Hdf5Handle file = create_checkpoint_hdf5(memory.path(), seal_bytes);
  memory.unname();
  write_attribute(file, "format_version", static_cast<std::int64_t>(checkpoint_format));
  write_attribute(file, "build_version", BEDFLOW_VERSION);
  write_attribute(file, "step", static_cast<std::int64_t>(content_.step));
  write_attribute(file, "time", content_.time);
  write_attribute(file, "ranks", static_cast<std::int64_t>(ranks_));
  for (const auto& [name, value] : content_.numbers) write_attribute(file, name, value);
  const auto place_of = [](hid_t dataset, std::uint64_t bytes) { return bytes == 0 ? 0 : H5Dget_offset(dataset); };
  {
    const Hdf5Handle dataset = create_dataset(file, "manifest", H5T_NATIVE_UINT8, {seal.manifest_bytes});
    write_attribute(dataset, "unit", "1");
    write_attribute(dataset, "meaning", "text: where each dataset lies, and the CRC32C of its blocks of 1 MiB");
    seal.manifest_place = place_of(dataset, seal.manifest_bytes);
  }
  for (std::size_t i = 0; i < datasets_.size(); ++i) {
    const Hdf5Handle dataset = create_dataset(file, datasets_[i].name, hdf5_type(datasets_[i].type), datasets_[i].shape);
    write_attribute(dataset, "unit", datasets_[i].unit);
    write_attribute(dataset, "meaning", datasets_[i].meaning);
    manifest.entries[i].place = place_of(dataset, manifest.entries[i].bytes);
  }
  file.close("close " + path.string());
  seal.file_bytes = memory.write_to(path);
  return manifest;
}

}  // namespace bedflow
