// Reading a verified checkpoint, on as many ranks as one likes.
#include <algorithm>
#include <array>
#include <numeric>

#include "checkpoint/agree.h"
#include "checkpoint/checkpoint.h"
#include "checkpoint/hdf5_file.h"
#include "checkpoint/seal.h"

namespace bedflow {

struct CheckpointReader::File {
  Comm comm;
  std::filesystem::path path;
  std::optional<Hdf5Handle> hdf5;
  std::int64_t step = 0, ranks = 0;
  double time = 0;

  // Collective: this part of a dataset, value by value. first and count as the dataset's shape.
  template <class Value>
  std::vector<Value> read(const std::string& array, hid_t type, std::span<const hsize_t> first,
                          std::span<const hsize_t> count) const;
  template <class Value>
  std::vector<Value> read_rows(const std::string& array, hid_t type) const;

  Hdf5Handle open(const std::string& array) const;
  std::vector<hsize_t> shape(const std::string& array) const;
  [[noreturn]] void refuse(const std::string& why) const { throw Stop(Reason::checkpoint_corrupt, path.string() + ": " + why); }
  template <class Value>
  Value attribute(const std::string& name, hid_t type) const;
};

namespace {

// The dataset's values within first … first + count − 1.
void read_slab(hid_t dataset, hid_t type, std::span<const hsize_t> first, std::span<const hsize_t> count, void* into) {
  const Hdf5Handle memory(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose,
                          "create a data space");
  const Hdf5Handle file(H5Dget_space(dataset), H5Sclose, "get a data space");
  check_hdf5(H5Sselect_hyperslab(file, H5S_SELECT_SET, first.data(), nullptr, count.data(), nullptr), "select a part");
  check_hdf5(H5Dread(dataset, type, memory, file, H5P_DEFAULT, into), "read a part");
}

std::size_t product(std::span<const hsize_t> count) {
  return std::accumulate(count.begin(), count.end(), std::size_t{1}, std::multiplies<>());
}

}  // namespace

Hdf5Handle CheckpointReader::File::open(const std::string& array) const {
  return Hdf5Handle(H5Dopen2(*hdf5, array.c_str(), H5P_DEFAULT), H5Dclose, "open dataset " + array + " of " + path.string());
}

std::vector<hsize_t> CheckpointReader::File::shape(const std::string& array) const {
  const Hdf5Handle dataset = open(array);
  const Hdf5Handle space(H5Dget_space(dataset), H5Sclose, "get a data space");
  std::vector<hsize_t> extents(static_cast<std::size_t>(std::max(H5Sget_simple_extent_ndims(space), 0)));
  check_hdf5(H5Sget_simple_extent_dims(space, extents.data(), nullptr), "get the shape of " + array);
  return extents;
}

template <class Value>
Value CheckpointReader::File::attribute(const std::string& name, hid_t type) const {
  if (H5Aexists(*hdf5, name.c_str()) <= 0) refuse("it has no number " + name);
  const Hdf5Handle attribute(H5Aopen(*hdf5, name.c_str(), H5P_DEFAULT), H5Aclose, "open attribute " + name);
  Value value{};
  check_hdf5(H5Aread(attribute, type, &value), "read attribute " + name);
  return value;
}

template <class Value>
std::vector<Value> CheckpointReader::File::read(const std::string& array, hid_t type, std::span<const hsize_t> first,
                                                std::span<const hsize_t> count) const {
  std::vector<Value> values;
  do_alike(comm, [&] {
    values.resize(product(count));
    if (!values.empty()) read_slab(open(array), type, first, count, values.data());
  });
  return values;
}

template <class Value>
std::vector<Value> CheckpointReader::File::read_rows(const std::string& array, hid_t type) const {
  std::vector<hsize_t> first, count;
  do_alike(comm, [&] {
    count = shape(array);
    if (count.empty() || count.size() > 2) refuse(array + " is not an array of rows");
    first.assign(count.size(), 0);
    const auto rank = static_cast<hsize_t>(comm.rank()), size = static_cast<hsize_t>(comm.size()), rows = count[0];
    std::array<std::int64_t, 2> bounds = {static_cast<std::int64_t>(rows * rank / size),
                                          static_cast<std::int64_t>(rows * (rank + 1) / size)};
    if (comm.size() == ranks) {
      const hsize_t two = 2;
      read_slab(open("rank_offsets/" + array), H5T_NATIVE_INT64, std::span(&rank, 1), std::span(&two, 1), bounds.data());
    }
    first[0] = static_cast<hsize_t>(bounds[0]);
    count[0] = static_cast<hsize_t>(bounds[1] - bounds[0]);
  });
  return read<Value>(array, type, first, count);
}

CheckpointReader::CheckpointReader(const Comm& comm, const std::filesystem::path& path)
    : file_(std::make_unique<File>(File{comm, path, {}})) {
  // Rank 0 judges seal, manifest and metadata, and every rank its share of the blocks; HDF5 comes after that.
  std::string text;
  do_alike(comm, [&] {
    if (!comm.root()) return;
    const PosixFile file(path, PosixFile::Mode::read);
    std::string fault;
    const std::optional<Seal> seal = Seal::read(file, fault);
    const std::optional<Manifest> manifest = seal ? read_manifest(file, *seal, fault) : std::nullopt;
    if (!manifest) file_->refuse(fault);
    if (file.bytes() != seal->file_bytes) file_->refuse(verify_checkpoint(path).front());
    if (metadata_checksum(file, *seal, *manifest) != seal->metadata_crc) file_->refuse("metadata: checksum does not match");
    text = manifest->text();
  });
  text = comm.broadcast(text);
  do_alike(comm, [&] {
    const Manifest manifest = Manifest::parse(text, UINT64_MAX).value();
    const auto faults = faulty_blocks(PosixFile(path, PosixFile::Mode::read), manifest, comm.rank(), comm.size());
    if (!faults.empty()) file_->refuse(faults.front());
    file_->hdf5.emplace(open_hdf5(path));
    file_->step = file_->attribute<std::int64_t>("step", H5T_NATIVE_INT64);
    file_->time = file_->attribute<double>("time", H5T_NATIVE_DOUBLE);
    file_->ranks = file_->attribute<std::int64_t>("ranks", H5T_NATIVE_INT64);
  });
}

CheckpointReader::~CheckpointReader() = default;

std::uint64_t CheckpointReader::step() const {
  return static_cast<std::uint64_t>(file_->step);
}
double CheckpointReader::time() const {
  return file_->time;
}
int CheckpointReader::ranks() const {
  return static_cast<int>(file_->ranks);
}
bool CheckpointReader::has_number(const std::string& name) const {
  return H5Aexists(*file_->hdf5, name.c_str()) > 0;
}
double CheckpointReader::number(const std::string& name) const {
  return file_->attribute<double>(name, H5T_NATIVE_DOUBLE);
}

bool CheckpointReader::has(const std::string& array) const {
  // HDF5 wants each group on the way to exist before it is asked for what is in it.
  for (std::size_t slash = array.find('/'); slash != std::string::npos; slash = array.find('/', slash + 1))
    if (H5Lexists(*file_->hdf5, array.substr(0, slash).c_str(), H5P_DEFAULT) <= 0) return false;
  return H5Lexists(*file_->hdf5, array.c_str(), H5P_DEFAULT) > 0;
}

std::string CheckpointReader::text(const std::string& array) const {
  const std::vector<hsize_t> shape = file_->shape(array);
  if (shape.size() != 1) file_->refuse(array + " is not a text");
  std::string text(shape[0], '\0');
  const hsize_t start = 0;
  if (!text.empty()) read_slab(file_->open(array), H5T_NATIVE_UINT8, std::span(&start, 1), shape, text.data());
  return text;
}

std::vector<double> CheckpointReader::grid(const std::string& array, const GridPart& part) const {
  std::vector<hsize_t> first, count;
  do_alike(file_->comm, [&] {
    const std::vector<hsize_t> shape = file_->shape(array);
    for (int d = 2; d >= 0; --d) {
      first.push_back(static_cast<hsize_t>(part.first[d]));
      count.push_back(static_cast<hsize_t>(part.count[d]));
      const std::size_t axis = first.size() - 1;
      if (shape.size() != 3 || shape[axis] != static_cast<hsize_t>(part.global[d]) || part.first[d] < 0 || part.count[d] < 0 ||
          part.first[d] + part.count[d] > part.global[d]) {
        file_->refuse("the grid of " + array + " is not the one of the case");
      }
    }
  });
  return file_->read<double>(array, H5T_NATIVE_DOUBLE, first, count);
}

std::vector<double> CheckpointReader::rows(const std::string& array) const {
  return file_->read_rows<double>(array, H5T_NATIVE_DOUBLE);
}
std::vector<std::int64_t> CheckpointReader::integer_rows(const std::string& array) const {
  return file_->read_rows<std::int64_t>(array, H5T_NATIVE_INT64);
}

}  // namespace bedflow
