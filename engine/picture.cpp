#include "picture.h"

#include <array>
#include <string>

#include "checkpoint/checkpoint.h"

namespace bedflow {

namespace {

Vec3 row(const std::vector<double>& rows, std::size_t i) {
  return {rows[3 * i], rows[3 * i + 1], rows[3 * i + 2]};
}

void read_particles(const CheckpointReader& reader, std::size_t most, Picture& picture) {
  if (!reader.has("particles/position") || most == 0) return;
  const std::vector<double> position = reader.rows("particles/position");
  const std::vector<double> velocity =
      reader.has("particles/velocity") ? reader.rows("particles/velocity") : std::vector<double>();
  const std::vector<double> radius = reader.has("particles/radius") ? reader.rows("particles/radius") : std::vector<double>();
  const std::size_t count = position.size() / 3, stride = (count + most - 1) / most;
  for (std::size_t i = 0; i < count; i += stride) {
    picture.positions.push_back(row(position, i));
    picture.speeds.push_back(velocity.size() == position.size() ? norm(row(velocity, i)) : 0);
    if (!radius.empty()) picture.diameters.push_back(2 * radius[i]);
  }
}

void read_gas(const CheckpointReader& reader, Picture& picture) {
  if (!reader.has("gas/fraction")) return;
  const Int3& n = picture.cells;
  const std::vector<double> fraction = reader.grid("gas/fraction", {n, {0, 0, 0}, n});
  const std::size_t layer = static_cast<std::size_t>(n[0]) * n[1];
  picture.gas_fraction.assign(layer, 0);
  for (std::size_t i = 0; i < fraction.size(); ++i) picture.gas_fraction[i % layer] += fraction[i] / n[2];
}

}  // namespace

Picture read_picture(const std::filesystem::path& checkpoint, std::uint32_t most_particles) {
  const CheckpointReader reader(Comm::self(), checkpoint);
  Picture picture;
  picture.step = reader.step();
  picture.time = reader.time();
  const auto number = [&](const std::string& name) { return reader.has_number(name) ? reader.number(name) : 0.0; };
  constexpr std::array<const char*, 3> axes = {"x", "y", "z"};
  for (int d = 0; d < 3; ++d) {
    picture.size[d] = number(std::string("domain/size_") + axes[d]);
    picture.cells[d] = static_cast<int>(number(std::string("cells/") + axes[d]));
  }
  picture.diameter = number("particles/diameter");
  read_particles(reader, most_particles, picture);
  read_gas(reader, picture);
  return picture;
}

}  // namespace bedflow
