// The few HDF5 calls that checkpoints and plot files need, with handles that close themselves and failures that name the object.
// The serial (sec2) driver only: one rank lays a file out; all ranks may read.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/stop.h"

namespace bedflow {

// Throws Stop(internal, "HDF5: cannot <what>") for an invalid identifier.
class Hdf5Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Hdf5Handle(hid_t id, Close closer, const std::string& what);
  ~Hdf5Handle();
  Hdf5Handle(Hdf5Handle&& other) noexcept;
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;
  operator hid_t() const { return id_; }
  // Closes now; throws Stop when that fails (what was buffered could not be written).
  void close(const std::string& what);

 private:
  hid_t id_;
  Close close_;
};

void check_hdf5(herr_t status, const std::string& what);

// Metadata of format 1.10 (with checksums), no older and no newer; a user block of so many bytes in front.
Hdf5Handle create_checkpoint_hdf5(const std::filesystem::path& path, std::uint64_t user_block);
// In the format that the widest range of readers knows; in memory, as image_of() gives it.
Hdf5Handle create_plot_hdf5();
std::vector<std::byte> image_of(hid_t file);
Hdf5Handle open_hdf5(const std::filesystem::path& path);

// Contiguous, allocated at once, not filled; groups in the path are made. type: a native type of HDF5.
Hdf5Handle create_dataset(hid_t file, const std::string& name, hid_t type, const std::vector<std::uint64_t>& shape);
// Values of type in memory order of the shape.
void write_dataset(hid_t file, const std::string& name, hid_t type, const std::vector<std::uint64_t>& shape, const void* values);

void write_attribute(hid_t object, const std::string& name, const std::string& text);  // fixed length, UTF-8 (ASCII if it is)
void write_attribute(hid_t object, const std::string& name, std::span<const double> values);
void write_attribute(hid_t object, const std::string& name, std::span<const std::int64_t> values);
void write_attribute(hid_t object, const std::string& name, double value);  // scalar
void write_attribute(hid_t object, const std::string& name, std::int64_t value);

}  // namespace bedflow
