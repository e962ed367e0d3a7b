#include "report/snapshot.h"

#include <limits>

#include "bedflow/v1/results.pb.h"
#include "picture.h"

namespace bedflow {

std::string snapshot_of(const std::filesystem::path& checkpoint, std::uint32_t most) {
  const Picture picture = read_picture(checkpoint, most > 0 ? most : std::numeric_limits<std::uint32_t>::max());
  v1::Snapshot snapshot;
  snapshot.set_step(picture.step);
  snapshot.set_time(picture.time);
  snapshot.mutable_size()->set_x(picture.size.x);
  snapshot.mutable_size()->set_y(picture.size.y);
  snapshot.mutable_size()->set_z(picture.size.z);
  snapshot.set_diameter(picture.diameter);
  for (const Vec3& place : picture.positions)
    for (int d = 0; d < 3; ++d) snapshot.add_position(static_cast<float>(place[d]));
  for (const double speed : picture.speeds) snapshot.add_speed(static_cast<float>(speed));
  for (const double diameter : picture.diameters) snapshot.add_diameters(static_cast<float>(diameter));
  snapshot.mutable_cells()->set_x(static_cast<std::uint32_t>(picture.cells[0]));
  snapshot.mutable_cells()->set_y(static_cast<std::uint32_t>(picture.cells[1]));
  snapshot.mutable_cells()->set_z(static_cast<std::uint32_t>(picture.cells[2]));
  for (const double fraction : picture.gas_fraction) snapshot.add_gas_fraction(static_cast<float>(fraction));
  return snapshot.SerializeAsString();
}

}  // namespace bedflow
