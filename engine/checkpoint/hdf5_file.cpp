#include "checkpoint/hdf5_file.h"

#include <algorithm>
#include <utility>

namespace bedflow {

namespace {

Hdf5Handle property_list(hid_t kind) {
  return Hdf5Handle(H5Pcreate(kind), H5Pclose, "create a property list");
}

// Every open object closes with the file; no lock files, which network file systems lack: names and ranks keep writers apart.
Hdf5Handle file_access() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // failures are told by Stop, not printed
  Hdf5Handle access = property_list(H5P_FILE_ACCESS);
  check_hdf5(H5Pset_fclose_degree(access, H5F_CLOSE_STRONG), "set the closing of a file");
  check_hdf5(H5Pset_file_locking(access, false, true), "do without file locks");
  return access;
}

// What is made by it does not tell when: a file is its content, to the bit.
Hdf5Handle timeless(hid_t kind) {
  Hdf5Handle creation = property_list(kind);
  check_hdf5(H5Pset_obj_track_times(creation, false), "leave times out");
  return creation;
}

// The groups on the way to a name, each made once.
void make_groups(hid_t file, const std::string& name) {
  for (auto end = name.find('/'); end != name.npos; end = name.find('/', end + 1)) {
    const std::string group = name.substr(0, end);
    if (H5Lexists(file, group.c_str(), H5P_DEFAULT) > 0) continue;
    const Hdf5Handle made(H5Gcreate2(file, group.c_str(), H5P_DEFAULT, timeless(H5P_GROUP_CREATE), H5P_DEFAULT), H5Gclose,
                          "create group " + group);
  }
}

Hdf5Handle space(const std::vector<std::uint64_t>& shape) {
  const std::vector<hsize_t> extents(shape.begin(), shape.end());
  return Hdf5Handle(
      extents.empty() ? H5Screate(H5S_SCALAR) : H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr),
      H5Sclose, "create a data space");
}

void write_attribute(hid_t object, const std::string& name, hid_t type, const std::vector<std::uint64_t>& shape,
                     const void* values) {
  const Hdf5Handle extent = space(shape);
  const Hdf5Handle attribute(H5Acreate2(object, name.c_str(), type, extent, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                             "create attribute " + name);
  check_hdf5(H5Awrite(attribute, type, values), "write attribute " + name);
}

}  // namespace

Hdf5Handle::Hdf5Handle(hid_t id, Close closer, const std::string& what) : id_(id), close_(closer) {
  if (id < 0) throw Stop(Reason::internal, "HDF5: cannot " + what);
}
Hdf5Handle::~Hdf5Handle() {
  if (id_ >= 0) close_(id_);
}
Hdf5Handle::Hdf5Handle(Hdf5Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}

void Hdf5Handle::close(const std::string& what) {
  if (close_(std::exchange(id_, -1)) < 0) throw Stop(Reason::internal, "HDF5: cannot " + what);
}

void check_hdf5(herr_t status, const std::string& what) {
  if (status < 0) throw Stop(Reason::internal, "HDF5: cannot " + what);
}

Hdf5Handle create_checkpoint_hdf5(const std::filesystem::path& path, std::uint64_t user_block) {
  const Hdf5Handle access = file_access();
  check_hdf5(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110), "choose format 1.10");
  const Hdf5Handle creation = timeless(H5P_FILE_CREATE);
  check_hdf5(H5Pset_userblock(creation, user_block), "keep a user block");
  return Hdf5Handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, access), H5Fclose, "create " + path.string());
}

Hdf5Handle create_plot_hdf5() {
  const Hdf5Handle access = file_access();
  check_hdf5(H5Pset_fapl_core(access, 1 << 20, false), "keep a file in memory");
  return Hdf5Handle(H5Fcreate("plot", H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose, "create a plot file");
}

std::vector<std::byte> image_of(hid_t file) {
  check_hdf5(H5Fflush(file, H5F_SCOPE_GLOBAL), "flush a plot file");
  const ssize_t size = H5Fget_file_image(file, nullptr, 0);
  std::vector<std::byte> image(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  if (size < 0 || H5Fget_file_image(file, image.data(), image.size()) != size)
    throw Stop(Reason::internal, "HDF5: cannot give the bytes of a plot file");
  return image;
}

Hdf5Handle open_hdf5(const std::filesystem::path& path) {
  const Hdf5Handle access = file_access();
  return Hdf5Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), H5Fclose, "open " + path.string());
}

Hdf5Handle create_dataset(hid_t file, const std::string& name, hid_t type, const std::vector<std::uint64_t>& shape) {
  make_groups(file, name);
  const Hdf5Handle creation = timeless(H5P_DATASET_CREATE);
  check_hdf5(H5Pset_layout(creation, H5D_CONTIGUOUS), "choose a contiguous layout");
  check_hdf5(H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY), "allocate early");
  check_hdf5(H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER), "fill never");
  const Hdf5Handle extent = space(shape);
  return Hdf5Handle(H5Dcreate2(file, name.c_str(), type, extent, H5P_DEFAULT, creation, H5P_DEFAULT), H5Dclose,
                    "create dataset " + name);
}

void write_dataset(hid_t file, const std::string& name, hid_t type, const std::vector<std::uint64_t>& shape, const void* values) {
  const Hdf5Handle dataset = create_dataset(file, name, type, shape);
  if (std::find(shape.begin(), shape.end(), 0U) != shape.end()) return;
  check_hdf5(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), "write dataset " + name);
}

void write_attribute(hid_t object, const std::string& name, const std::string& text) {
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "create a text type");
  check_hdf5(H5Tset_size(type, std::max<std::size_t>(text.size(), 1)), "set a text's length");
  check_hdf5(H5Tset_strpad(type, H5T_STR_NULLPAD), "set a text's padding");
  const bool ascii = std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 128; });
  check_hdf5(H5Tset_cset(type, ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8), "set a text's encoding");
  write_attribute(object, name, type, {}, text.c_str());
}
void write_attribute(hid_t object, const std::string& name, std::span<const double> values) {
  write_attribute(object, name, H5T_NATIVE_DOUBLE, {values.size()}, values.data());
}
void write_attribute(hid_t object, const std::string& name, std::span<const std::int64_t> values) {
  write_attribute(object, name, H5T_NATIVE_INT64, {values.size()}, values.data());
}
void write_attribute(hid_t object, const std::string& name, double value) {
  write_attribute(object, name, H5T_NATIVE_DOUBLE, {}, &value);
}
void write_attribute(hid_t object, const std::string& name, std::int64_t value) {
  write_attribute(object, name, H5T_NATIVE_INT64, {}, &value);
}

}  // namespace bedflow
