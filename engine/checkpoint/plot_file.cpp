#include "checkpoint/plot_file.h"

#include <array>
#include <cstring>
#include <numeric>
#include <optional>

#include "checkpoint/agree.h"
#include "checkpoint/hdf5_file.h"
#include "checkpoint/plot_series.h"
#include "checkpoint/posix_file.h"

namespace bedflow {

namespace fs = std::filesystem;

namespace {

// An array of all ranks, on rank 0: values side by side, of 32-bit floats or 64-bit integers.
struct Gathered {
  std::string name, unit;
  std::size_t components = 1;
  bool integer = false;
  std::vector<std::byte> bytes;

  std::size_t value_size() const { return integer ? 8 : 4 * components; }  // bytes a cell or particle
  hid_t type() const { return integer ? H5T_NATIVE_INT64 : H5T_NATIVE_FLOAT; }
};

std::vector<float> floats(std::span<const double> values) {
  return {values.begin(), values.end()};
}
std::vector<float> floats(std::span<const Vec3> values) {
  std::vector<float> result;
  result.reserve(3 * values.size());
  for (const Vec3& value : values)
    for (int d = 0; d < 3; ++d) result.push_back(static_cast<float>(value[d]));
  return result;
}

template <class Value>
std::vector<std::byte> gather(const Comm& comm, const std::vector<Value>& mine) {
  return comm.gather(std::as_bytes(std::span(mine)));
}

Gathered gather(const Comm& comm, const PlotArray& array) {
  Gathered result{array.name, array.unit, 1, false, {}};
  if (const auto* reals = std::get_if<std::vector<double>>(&array.values)) {
    result.bytes = gather(comm, floats(*reals));
  } else if (const auto* vectors = std::get_if<std::vector<Vec3>>(&array.values)) {
    result.components = 3;
    result.bytes = gather(comm, floats(*vectors));
  } else {
    result.integer = true;
    result.bytes = gather(comm, std::get<std::vector<std::int64_t>>(array.values));
  }
  return result;
}

std::vector<Gathered> gather(const Comm& comm, const std::vector<PlotArray>& arrays, std::size_t values) {
  do_alike(comm, [&] {
    for (const PlotArray& array : arrays) {
      if (std::visit([](const auto& all) { return all.size(); }, array.values) != values)
        throw Stop(Reason::internal, "plot array " + array.name + ": its values are not one a cell or particle");
    }
  });
  std::vector<Gathered> result;
  result.reserve(arrays.size());
  for (const PlotArray& array : arrays) result.push_back(gather(comm, array));
  return result;
}

// The ranks' blocks, one after another, into one grid, x fastest.
std::vector<std::byte> in_grid_order(const std::vector<GridPart>& parts, const Gathered& array) {
  std::vector<std::byte> grid(array.bytes.size());
  const std::byte* from = array.bytes.data();
  for (const GridPart& part : parts) {
    const std::size_t line = static_cast<std::size_t>(part.count[0]) * array.value_size();
    for (int k = 0; k < part.count[2]; ++k) {
      for (int j = 0; j < part.count[1]; ++j, from += line) {
        const std::size_t row = static_cast<std::size_t>(part.first[2] + k) * part.global[1] + (part.first[1] + j);
        std::memcpy(grid.data() + (row * part.global[0] + part.first[0]) * array.value_size(), from, line);
      }
    }
  }
  return grid;
}

Hdf5Handle create_group(hid_t parent, const std::string& name) {
  return Hdf5Handle(H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, "create group " + name);
}

// The group that every VTKHDF file has, with the type of data set in it.
Hdf5Handle create_root(hid_t file, const std::string& type, std::uint64_t step, double time) {
  Hdf5Handle root = create_group(file, "VTKHDF");
  write_attribute(root, "Version", std::array<std::int64_t, 2>{1, 0});
  write_attribute(root, "Type", type);
  write_attribute(root, "step", static_cast<std::int64_t>(step));
  write_attribute(root, "time", time);
  return root;
}

void write_arrays(hid_t parent, const std::string& name, const std::vector<Gathered>& arrays) {
  const Hdf5Handle group = create_group(parent, name);
  for (const Gathered& array : arrays) {
    std::vector<std::uint64_t> shape = {array.bytes.size() / array.value_size()};
    if (array.components > 1) shape.push_back(array.components);
    write_dataset(group, array.name, array.type(), shape, array.bytes.data());
    const Hdf5Handle dataset(H5Dopen2(group, array.name.c_str(), H5P_DEFAULT), H5Dclose, "open dataset " + array.name);
    write_attribute(dataset, "unit", array.unit);
  }
}

// Rank 0: the file by way of a partial one, then the series. `fill` writes into the open file.
template <class Fill>
void write_plot(const Comm& comm, const fs::path& folder, const std::string& kind, std::uint64_t step, double time,
                std::uint64_t bytes, Fill fill) {
  do_alike(comm, [&] {
    if (!comm.root()) return;
    fs::create_directory(folder);              // not the job's folder, should somebody have removed it
    constexpr std::uint64_t metadata = 65536;  // far more than a plot file's groups and attributes take
    check_room(folder, bytes + metadata);
    const fs::path path = folder / plot_name(kind, step), partial = path.string() + ".partial";
    try {
      Hdf5Handle file = create_plot_hdf5();
      fill(file);
      const std::vector<std::byte> image = image_of(file);
      file.close("close a plot file");
      const PosixFile written(partial, PosixFile::Mode::create);
      written.write(image, 0);
      rename_for_good(partial, path);
    } catch (const Stop&) {
      std::error_code ignored;
      fs::remove(partial, ignored);
      throw;
    }
    append_to_series(folder, kind, step, time);
  });
}

std::uint64_t bytes_of(const std::vector<Gathered>& arrays) {
  std::uint64_t bytes = 0;
  for (const Gathered& array : arrays) bytes += array.bytes.size();
  return bytes;
}

}  // namespace

void write_gas_plot(const Comm& comm, const fs::path& folder, std::uint64_t step, double time, const GridPart& part, Vec3 spacing,
                    const std::vector<PlotArray>& cell_arrays) {
  const std::size_t cells = static_cast<std::size_t>(part.count[0]) * part.count[1] * part.count[2];
  std::vector<Gathered> arrays = gather(comm, cell_arrays, cells);
  const std::vector<std::byte> told = gather(comm, std::vector<GridPart>{part});
  std::vector<GridPart> parts(told.size() / sizeof(GridPart));
  if (!told.empty()) std::memcpy(parts.data(), told.data(), told.size());
  for (Gathered& array : arrays) array.bytes = in_grid_order(parts, array);

  write_plot(comm, folder, "gas", step, time, bytes_of(arrays), [&](hid_t file) {
    const Hdf5Handle root = create_root(file, "OverlappingAMR", step, time);
    write_attribute(root, "GridDescription", "XYZ");
    write_attribute(root, "Origin", std::array<double, 3>{0, 0, 0});
    const Hdf5Handle level = create_group(root, "Level0");
    write_attribute(level, "Spacing", std::array<double, 3>{spacing.x, spacing.y, spacing.z});
    const Int3& n = part.global;  // the box: first and last cell in each direction
    const std::array<std::int32_t, 6> box = {0, n[0] - 1, 0, n[1] - 1, 0, n[2] - 1};
    write_dataset(level, "AMRBox", H5T_NATIVE_INT32, {1, 6}, box.data());
    write_arrays(level, "CellData", arrays);
    for (const char* name : {"PointData", "FieldData"}) create_group(level, name);  // empty; the reader looks for them
  });
}

void write_particle_plot(const Comm& comm, const fs::path& folder, std::uint64_t step, double time,
                         std::span<const Vec3> positions, const std::vector<PlotArray>& point_arrays) {
  const std::vector<Gathered> arrays = gather(comm, point_arrays, positions.size());
  const std::vector<std::byte> points = gather(comm, floats(positions));
  const std::uint64_t count = points.size() / (3 * sizeof(float));

  write_plot(comm, folder, "particles", step, time, bytes_of(arrays) + points.size() + 17 * count, [&](hid_t file) {
    const Hdf5Handle root = create_root(file, "UnstructuredGrid", step, time);
    const auto counted = static_cast<std::int64_t>(count);
    for (const char* name : {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"})
      write_dataset(root, name, H5T_NATIVE_INT64, {1}, &counted);
    write_dataset(root, "Points", H5T_NATIVE_FLOAT, {count, 3}, points.data());
    // Cell i is the vertex of point i.
    std::vector<std::int64_t> numbers(count + 1);
    std::iota(numbers.begin(), numbers.end(), std::int64_t{0});
    write_dataset(root, "Connectivity", H5T_NATIVE_INT64, {count}, numbers.data());
    write_dataset(root, "Offsets", H5T_NATIVE_INT64, {count + 1}, numbers.data());
    constexpr std::uint8_t vertex = 1;  // VTK_VERTEX
    write_dataset(root, "Types", H5T_NATIVE_UINT8, {count}, std::vector<std::uint8_t>(count, vertex).data());
    write_arrays(root, "PointData", arrays);
  });
}

}  // namespace bedflow
