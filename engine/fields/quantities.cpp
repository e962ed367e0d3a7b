#include "fields/quantities.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/sphere.h"

namespace bedflow {

namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
constexpr std::string_view axes = "xyz";

const std::vector<Quantity>& gas_quantities() {
  static const std::vector<Quantity> list = {{"pressure", "Pa", "gas pressure p at cell centres"},
                                             {"gas_fraction", "1", "gas fraction ε of the last deposit"},
                                             {"solids_fraction", "1", "1 − ε"},
                                             {"gas_velocity_x", "m/s", "gas velocity along x at cell centres"},
                                             {"gas_velocity_y", "m/s", "gas velocity along y at cell centres"},
                                             {"gas_velocity_z", "m/s", "gas velocity along z at cell centres"},
                                             {"gas_speed", "m/s", "magnitude of the gas velocity"}};
  return list;
}

const std::vector<Quantity>& solids_quantities() {
  static const std::vector<Quantity> list = {{"particle_number", "1", "particles with their centres in a cell"},
                                             {"solids_velocity_x", "m/s", "mean velocity of a cell's particles along x"},
                                             {"solids_velocity_y", "m/s", "mean velocity of a cell's particles along y"},
                                             {"solids_velocity_z", "m/s", "mean velocity of a cell's particles along z"},
                                             {"granular_temperature", "m²/s²", "a third of the mean square of V − <V>"}};
  return list;
}

const std::vector<Quantity>& particle_quantities() {
  static const std::vector<Quantity> list = {{"particle_id", "1", "identity, for life", true},
                                             {"particle_type", "1", "place among the case's types", true},
                                             {"particle_x", "m", "centre", true},
                                             {"particle_y", "m", "centre", true},
                                             {"particle_z", "m", "centre", true},
                                             {"particle_velocity_x", "m/s", "velocity V along x", true},
                                             {"particle_velocity_y", "m/s", "velocity V along y", true},
                                             {"particle_velocity_z", "m/s", "velocity V along z", true},
                                             {"particle_speed", "m/s", "magnitude of V", true},
                                             {"particle_spin_x", "rad/s", "angular velocity ω about x", true},
                                             {"particle_spin_y", "rad/s", "angular velocity ω about y", true},
                                             {"particle_spin_z", "rad/s", "angular velocity ω about z", true},
                                             {"particle_spin", "rad/s", "magnitude of ω", true},
                                             {"particle_diameter", "m", "diameter", true},
                                             {"particle_volume", "m³", "volume", true},
                                             {"particle_kinetic_energy", "J", "½ m V² + ½ I ω²", true}};
  return list;
}

// The direction that a name ends with, or -1 for a magnitude.
int axis_of(const std::string& name) {
  if (name.size() < 2 || name[name.size() - 2] != '_') return -1;
  const std::size_t axis = axes.find(name.back());
  return axis == std::string_view::npos ? -1 : static_cast<int>(axis);
}

// Column d of rows of three, or their magnitude.
std::vector<double> component(const std::vector<double>& rows, int d) {
  std::vector<double> values(rows.size() / 3);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Vec3 row{rows[3 * i], rows[3 * i + 1], rows[3 * i + 2]};
    values[i] = d < 0 ? norm(row) : row[d];
  }
  return values;
}

template <class Take>
void each_cell(const CellBlock& block, Take take) {
  std::size_t place = 0;
  for (int k = 0; k < block.count[2]; ++k)
    for (int j = 0; j < block.count[1]; ++j)
      for (int i = 0; i < block.count[0]; ++i) take(place++, Int3{block.first[0] + i, block.first[1] + j, block.first[2] + k});
}

}  // namespace

FieldSource::FieldSource(const std::filesystem::path& checkpoint) : reader_(Comm::self(), checkpoint, Verified::as_read) {
  const bool gas = reader_.has("gas/pressure");
  for (int d = 0; d < 3; ++d) {
    const std::string axis(1, axes[static_cast<std::size_t>(d)]);
    size_[d] = reader_.number("domain/size_" + axis);
    const double cells = gas ? reader_.number("cells/" + axis) : 0;
    if (!(size_[d] > 0) || !std::isfinite(size_[d]) || !(cells >= 0) || cells > 1e6 || (gas && cells < 1))
      throw Stop(Reason::checkpoint_corrupt, checkpoint.string() + ": its box or its grid has no size");
    cells_[d] = static_cast<int>(cells);
  }
  has_particles_ = reader_.has("particles/position");
}

std::vector<Quantity> FieldSource::quantities() const {
  std::vector<Quantity> all;
  const auto add = [&](const std::vector<Quantity>& some) { all.insert(all.end(), some.begin(), some.end()); };
  if (has_gas()) add(gas_quantities());
  if (has_gas() && has_particles()) add(solids_quantities());
  if (has_particles()) add(particle_quantities());
  return all;
}

Quantity FieldSource::quantity(const std::string& name) const {
  std::string names;
  for (const Quantity& quantity : quantities()) {
    if (quantity.name == name) return quantity;
    names += (names.empty() ? "" : ", ") + quantity.name;
  }
  throw FieldRefusal("there is no quantity '" + name.substr(0, 60) + "' in this checkpoint; there are: " + names);
}

std::vector<double> FieldSource::gas_velocity(int d, const CellBlock& block) const {
  GridPart faces{cells_, block.first, block.count};
  ++faces.global[d];
  ++faces.count[d];
  const std::vector<double> at_faces = reader_.grid(std::string("gas/velocity_") + axes[static_cast<std::size_t>(d)], faces);
  std::vector<double> values(block.size());
  std::size_t stride = 1;
  for (int e = 0; e < d; ++e) stride *= static_cast<std::size_t>(faces.count[e]);
  const auto row = static_cast<std::size_t>(faces.count[0]), layer = row * static_cast<std::size_t>(faces.count[1]);
  each_cell({{}, block.count}, [&](std::size_t place, Int3 cell) {
    const std::size_t low =
        static_cast<std::size_t>(cell[0]) + row * static_cast<std::size_t>(cell[1]) + layer * static_cast<std::size_t>(cell[2]);
    values[place] = 0.5 * (at_faces[low] + at_faces[low + stride]);
  });
  return values;
}

std::vector<double> FieldSource::in_cells(const std::string& name, const CellBlock& block) const {
  if (block.size() == 0) return {};
  const GridPart part{cells_, block.first, block.count};
  if (name == "pressure") {
    std::vector<double> values = reader_.grid("gas/pressure", part);
    const Vec3 fall{number("gas/fall_x"), number("gas/fall_y"), number("gas/fall_z")}, h = spacing();
    if (fall == Vec3{}) return values;
    each_cell(block, [&](std::size_t place, Int3 cell) {
      values[place] -= dot(fall, Vec3{(cell[0] + 0.5) * h.x, (cell[1] + 0.5) * h.y, (cell[2] + 0.5) * h.z});
    });
    return values;
  }
  if (name == "gas_fraction" || name == "solids_fraction") {
    std::vector<double> values = reader_.grid("gas/fraction", part);
    if (name == "solids_fraction") std::for_each(values.begin(), values.end(), [](double& value) { value = 1 - value; });
    return values;
  }
  if (name == "gas_speed") {
    std::vector<double> squares(block.size());
    for (int d = 0; d < 3; ++d) {
      const std::vector<double> along = gas_velocity(d, block);
      for (std::size_t i = 0; i < squares.size(); ++i) squares[i] += along[i] * along[i];
    }
    std::for_each(squares.begin(), squares.end(), [](double& value) { value = std::sqrt(value); });
    return squares;
  }
  if (name.starts_with("gas_velocity_")) return gas_velocity(axis_of(name), block);
  return of_solids(name, block);
}

std::vector<double> FieldSource::of_solids(const std::string& name, const CellBlock& block) const {
  const std::vector<double>&x = positions(), &v = velocities();
  const Vec3 h = spacing();
  std::vector<double> number(block.size()), squares(block.size());
  std::vector<Vec3> sums(block.size());
  const auto cell_of = [&](std::size_t p) -> std::optional<std::size_t> {
    std::size_t place = 0;
    for (int d = 2; d >= 0; --d) {
      const int cell =
          std::clamp(static_cast<int>(x[3 * p + static_cast<std::size_t>(d)] / h[d]), 0, cells_[d] - 1) - block.first[d];
      if (cell < 0 || cell >= block.count[d]) return std::nullopt;
      place = place * static_cast<std::size_t>(block.count[d]) + static_cast<std::size_t>(cell);
    }
    return place;
  };
  for (std::size_t p = 0; p < x.size() / 3; ++p) {
    if (const auto cell = cell_of(p)) {
      number[*cell] += 1;
      sums[*cell] += Vec3{v[3 * p], v[3 * p + 1], v[3 * p + 2]};
    }
  }
  if (name == "particle_number") return number;
  std::vector<double> values(block.size(), nothing);
  if (const int d = axis_of(name); d >= 0) {
    for (std::size_t i = 0; i < values.size(); ++i)
      if (number[i] > 0) values[i] = sums[i][d] / number[i];
    return values;
  }
  for (std::size_t p = 0; p < x.size() / 3; ++p) {
    if (const auto cell = cell_of(p)) {
      const Vec3 beside = Vec3{v[3 * p], v[3 * p + 1], v[3 * p + 2]} - (1 / number[*cell]) * sums[*cell];
      squares[*cell] += dot(beside, beside);
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    if (number[i] > 0) values[i] = squares[i] / (3 * number[i]);
  return values;
}

const std::vector<double>& FieldSource::positions() const {
  if (positions_.empty()) positions_ = reader_.rows("particles/position");
  return positions_;
}

const std::vector<double>& FieldSource::velocities() const {
  if (velocities_.empty()) velocities_ = reader_.rows("particles/velocity");
  if (velocities_.size() != positions().size()) {
    throw Stop(Reason::checkpoint_corrupt, "the checkpoint has " + std::to_string(positions().size() / 3) + " positions and " +
                                               std::to_string(velocities_.size() / 3) + " velocities");
  }
  return velocities_;
}

std::vector<double> FieldSource::radii() const {
  if (reader_.has("particles/radius")) return reader_.rows("particles/radius");
  return std::vector<double>(positions().size() / 3, 0.5 * number("particles/diameter"));
}

// m = ρ 𝒱, I = (2/5) m r²
std::vector<double> FieldSource::kinetic_energies() const {
  const std::vector<double> speed = component(velocities(), -1), radius = radii(), type = of_particles("particle_type"),
                            spin = of_particles("particle_spin");
  std::vector<double> densities;
  for (std::size_t t = 0; t < static_cast<std::size_t>(std::clamp(number("particles/types"), 0.0, 1e3)); ++t) {
    const std::string density = "particles/type_" + std::to_string(t) + "_density";
    if (!reader_.has_number(density))
      throw FieldRefusal("this checkpoint is of an older version: it has no densities of particles");
    densities.push_back(reader_.number(density));
  }
  std::vector<double> energies(speed.size(), nothing);
  for (std::size_t p = 0; p < std::min({energies.size(), radius.size(), type.size(), spin.size()}); ++p) {
    const auto t = static_cast<std::size_t>(std::max(type[p], 0.0));
    if (t >= densities.size()) continue;
    const double mass = densities[t] * sphere_volume(2 * radius[p]);
    energies[p] = 0.5 * (mass * speed[p] * speed[p] + inertia_of(mass, radius[p]) * spin[p] * spin[p]);
  }
  return energies;
}

std::vector<double> FieldSource::of_particles(const std::string& name) const {
  const std::size_t count = positions().size() / 3;
  const auto integers = [&](const char* array) {
    const std::vector<std::int64_t> values = reader_.integer_rows(array);
    return std::vector<double>(values.begin(), values.end());
  };
  std::vector<double> values;
  if (name == "particle_id") {
    values = integers("particles/id");
  } else if (name == "particle_type") {
    values = reader_.has("particles/type") ? integers("particles/type") : std::vector<double>(count, 0);
  } else if (name == "particle_speed" || name.starts_with("particle_velocity_")) {
    values = component(velocities(), axis_of(name));
  } else if (name.starts_with("particle_spin")) {
    values =
        reader_.has("particles/spin") ? component(reader_.rows("particles/spin"), axis_of(name)) : std::vector<double>(count, 0);
  } else if (name == "particle_diameter" || name == "particle_volume") {
    values = radii();
    std::for_each(values.begin(), values.end(), [&](double& r) { r = name == "particle_volume" ? sphere_volume(2 * r) : 2 * r; });
  } else if (name == "particle_kinetic_energy") {
    values = kinetic_energies();
  } else {
    values = component(positions(), axis_of(name));
  }
  if (values.size() != count) {
    throw Stop(Reason::checkpoint_corrupt,
               "the checkpoint has " + std::to_string(count) + " particles and " + std::to_string(values.size()) + " of " + name);
  }
  return values;
}

}  // namespace bedflow
