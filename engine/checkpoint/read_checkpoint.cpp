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
  std::optional<Hdf5Handle> hdf5{};
  Manifest manifest{};
  Verified verified = Verified::whole;
  std::int64_t step = 0, ranks = 0;
  double time = 0;

  void verify(const std::string& array) const;  // its blocks, if that has been left to now

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

// A text attribute of at most a line or two; empty when there is none such.
std::string text_attribute(hid_t object, const char* name) {
  constexpr std::size_t most = 4096;
  if (H5Aexists(object, name) <= 0) return {};
  const Hdf5Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose, "open attribute " + std::string(name));
  const Hdf5Handle type(H5Aget_type(attribute), H5Tclose, "get an attribute's type");
  const Hdf5Handle space(H5Aget_space(attribute), H5Sclose, "get an attribute's extent");
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0) return {};
  const std::size_t size = H5Tget_size(type);
  if (size > most || H5Sget_simple_extent_npoints(space) != 1) return {};
  std::string text(size, '\0');
  check_hdf5(H5Aread(attribute, type, text.data()), "read attribute " + std::string(name));
  return text.substr(0, text.find('\0'));
}

// One of the three types that checkpoints have, as it is in memory.
std::optional<Dataset::Type> type_of(hid_t dataset) {
  const Hdf5Handle type(H5Dget_type(dataset), H5Tclose, "get a type");
  if (H5Tequal(type, H5T_NATIVE_DOUBLE) > 0) return Dataset::Type::real;
  if (H5Tequal(type, H5T_NATIVE_INT64) > 0) return Dataset::Type::integer;
  if (H5Tequal(type, H5T_NATIVE_UINT8) > 0) return Dataset::Type::byte;
  return std::nullopt;
}

// Whether every step of the path is a link within the file, and the last one a dataset's.
bool lies_within(hid_t file, const std::string& path) {
  for (std::size_t slash = path.find('/');; slash = path.find('/', slash + 1)) {
    H5L_info_t link{};
    const std::string part = path.substr(0, slash);
    if (H5Lexists(file, part.c_str(), H5P_DEFAULT) <= 0) return false;
    if (H5Lget_info(file, part.c_str(), &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) return false;
    if (slash == std::string::npos) return true;
  }
}

// What is wrong with how a dataset lies in its file; nothing when it is as the manifest says.
std::string fault_of(hid_t dataset, const ManifestEntry& entry, std::span<const std::uint64_t> shape, Dataset::Type type) {
  const Hdf5Handle creation(H5Dget_create_plist(dataset), H5Pclose, "get a dataset's properties");
  if (H5Pget_layout(creation) != H5D_CONTIGUOUS || H5Pget_external_count(creation) != 0 || H5Pget_nfilters(creation) != 0)
    return "is not plain numbers side by side";
  std::uint64_t bytes = type == Dataset::Type::byte ? 1 : 8;
  for (const std::uint64_t extent : shape) {
    if (__builtin_mul_overflow(bytes, extent, &bytes)) return "has a shape beyond all memory";
  }
  if (bytes != entry.bytes)
    return "has a shape of " + std::to_string(bytes) + " bytes; " + std::to_string(entry.bytes) + " are there";
  if (bytes > 0 && H5Dget_offset(dataset) != entry.place) return "does not lie where the manifest says";
  return {};
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

void CheckpointReader::File::verify(const std::string& array) const {
  if (verified == Verified::whole) return;
  Manifest one;
  for (const ManifestEntry& entry : manifest.entries)
    if (entry.name == array) one.entries.push_back(entry);
  if (one.entries.empty()) refuse(array + " is not in the manifest");
  const auto faults = faulty_blocks(PosixFile(path, PosixFile::Mode::read), one);
  if (!faults.empty()) refuse(faults.front());
}

template <class Value>
std::vector<Value> CheckpointReader::File::read(const std::string& array, hid_t type, std::span<const hsize_t> first,
                                                std::span<const hsize_t> count) const {
  std::vector<Value> values;
  do_alike(comm, [&] {
    verify(array);
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
    if (comm.size() == ranks && ranks > 1) {
      const hsize_t two = 2;
      verify("rank_offsets/" + array);
      read_slab(open("rank_offsets/" + array), H5T_NATIVE_INT64, std::span(&rank, 1), std::span(&two, 1), bounds.data());
    }
    first[0] = static_cast<hsize_t>(bounds[0]);
    count[0] = static_cast<hsize_t>(bounds[1] - bounds[0]);
  });
  return read<Value>(array, type, first, count);
}

CheckpointReader::CheckpointReader(const Comm& comm, const std::filesystem::path& path, Verified verified)
    : file_(std::make_unique<File>(File{.comm = comm, .path = path, .verified = verified})) {
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
    file_->manifest = Manifest::parse(text, UINT64_MAX).value();
    if (verified == Verified::whole) {
      const auto faults = faulty_blocks(PosixFile(path, PosixFile::Mode::read), file_->manifest, comm.rank(), comm.size());
      if (!faults.empty()) file_->refuse(faults.front());
    }
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

std::map<std::string, double> CheckpointReader::numbers() const {
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5A_info_t*, void* into) -> herr_t {
    static_cast<std::vector<std::string>*>(into)->emplace_back(name);
    return 0;
  };
  check_hdf5(H5Aiterate2(*file_->hdf5, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names), "list the numbers");
  std::map<std::string, double> numbers;
  for (const std::string& name : names) {
    const Hdf5Handle attribute(H5Aopen(*file_->hdf5, name.c_str(), H5P_DEFAULT), H5Aclose, "open attribute " + name);
    const Hdf5Handle type(H5Aget_type(attribute), H5Tclose, "get an attribute's type");
    const Hdf5Handle space(H5Aget_space(attribute), H5Sclose, "get an attribute's extent");
    if (H5Tequal(type, H5T_NATIVE_DOUBLE) <= 0 || H5Sget_simple_extent_npoints(space) != 1) continue;
    check_hdf5(H5Aread(attribute, H5T_NATIVE_DOUBLE, &numbers[name]), "read attribute " + name);
  }
  return numbers;
}

std::vector<Dataset> CheckpointReader::datasets() const {
  std::vector<Dataset> found;
  for (const ManifestEntry& entry : file_->manifest.entries) {
    if (entry.name.empty() || entry.name.front() == '/' ||
        entry.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_/") != std::string::npos ||
        !lies_within(*file_->hdf5, entry.name)) {
      file_->refuse("the manifest names '" + entry.name.substr(0, 80) + "', which is not in the file");
    }
    const Hdf5Handle dataset = file_->open(entry.name);
    const std::vector<hsize_t> shape = file_->shape(entry.name);
    const std::optional<Dataset::Type> type = type_of(dataset);
    if (!type || shape.empty() || shape.size() > 3) file_->refuse(entry.name + " is no array of a checkpoint's kinds");
    Dataset described{
        entry.name, text_attribute(dataset, "unit"), text_attribute(dataset, "meaning"), *type, {shape.begin(), shape.end()}};
    const std::string fault = fault_of(dataset, entry, described.shape, *type);
    if (!fault.empty()) file_->refuse(entry.name + " " + fault);
    found.push_back(std::move(described));
  }
  return found;
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
  file_->verify(array);
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
