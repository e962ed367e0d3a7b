// What may be asked of a checkpoint, cell by cell or particle by particle, by name. For one rank alone.
//
// Gas: p with its fall where the flow is driven; ε of the last deposit; velocities at cell centres, the mean of the two faces.
// Solids in a cell: of the particles whose centres lie in it. Granular temperature θ = <|V − <V>|²>/3 (Goldschmidt 2004).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/vec3.h"
#include "checkpoint/checkpoint.h"

namespace bedflow {

// A question that cannot be answered, and why: it is wrong, or of something that the scene does not have.
struct FieldRefusal : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

struct Quantity {
  std::string name, unit, meaning;
  bool of_particles = false;
};

// A block of cells.
struct CellBlock {
  Int3 first{}, count{};
  std::size_t size() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) * static_cast<std::size_t>(count[2]);
  }
};

// A checkpoint, of which only what is asked for is read and verified. Throws Stop(checkpoint_corrupt) naming dataset and block.
class FieldSource {
 public:
  explicit FieldSource(const std::filesystem::path& checkpoint);

  const CheckpointReader& reader() const { return reader_; }
  Vec3 size() const { return size_; }    // of the box, m
  Int3 cells() const { return cells_; }  // 0 without gas
  Vec3 spacing() const { return {size_.x / cells_[0], size_.y / cells_[1], size_.z / cells_[2]}; }
  bool has_gas() const { return cells_[0] > 0; }
  bool has_particles() const { return has_particles_; }

  std::vector<Quantity> quantities() const;          // that this checkpoint has
  Quantity quantity(const std::string& name) const;  // throws FieldRefusal with the names there are
  // x fastest. NaN where a cell has no value.
  std::vector<double> in_cells(const std::string& name, const CellBlock& block) const;
  // One a particle, in the order of the file.
  std::vector<double> of_particles(const std::string& name) const;
  const std::vector<double>& positions() const;  // x, y, z of each

 private:
  double number(const std::string& name) const { return reader_.has_number(name) ? reader_.number(name) : 0; }
  std::vector<double> gas_velocity(int d, const CellBlock& block) const;
  std::vector<double> of_solids(const std::string& name, const CellBlock& block) const;
  std::vector<double> radii() const;
  std::vector<double> kinetic_energies() const;
  const std::vector<double>& velocities() const;

  CheckpointReader reader_;
  Vec3 size_;
  Int3 cells_{};
  bool has_particles_ = false;
  mutable std::vector<double> positions_, velocities_;
};

}  // namespace bedflow
