#include "case/wall_scene.h"

#include "case/vector.h"
#include "geometry/cut_cells.h"

namespace bedflow {

namespace {

Vec3 direction(const v1::Vector& v) {
  const Vec3 any = vec(v);
  return 1 / norm(any) * any;
}

Keep keep(v1::WallSide side) {
  return side == v1::INSIDE ? Keep::inside : side == v1::OUTSIDE ? Keep::outside : Keep::either;
}

Plane plane(const v1::PlaneWall& from) {
  const Vec3 normal = direction(from.normal());
  return {normal, dot(normal, vec(from.point()))};
}

Revolved profile(const v1::ProfileWall& from) {
  std::vector<Revolved::Corner> corners;
  for (const v1::ProfileCorner& corner : from.corners()) corners.push_back({corner.radius(), corner.height()});
  return {vec(from.origin()), vec(from.axis()), std::move(corners), keep(from.particles())};
}

Mesh mesh(const v1::MeshWall& from) {
  const auto place = [&](const v1::Vector& v) { return from.scale() * vec(v) + vec(from.translation()); };
  std::vector<Facet> facets;
  for (const v1::Triangle& t : from.triangles()) facets.push_back(Facet::of({place(t.a()), place(t.b()), place(t.c())}));
  return Mesh(std::move(facets), from.feature_angle());
}

Surface surface(const v1::Wall& from) {
  switch (from.surface_case()) {
    case v1::Wall::kBox:
      return Box{vec(from.box().low()), vec(from.box().high()), keep(from.box().particles())};
    case v1::Wall::kCylinder: {
      const v1::CylinderWall& shape = from.cylinder();
      return Revolved::cylinder(vec(shape.from()), vec(shape.to()), shape.radius(), shape.closed(), keep(shape.particles()));
    }
    case v1::Wall::kCone: {
      const v1::ConeWall& shape = from.cone();
      return Revolved::cone(vec(shape.from()), vec(shape.to()), shape.radius_from(), shape.radius_to(), shape.closed(),
                            keep(shape.particles()));
    }
    case v1::Wall::kProfile:
      return profile(from.profile());
    case v1::Wall::kMesh:
      return mesh(from.mesh());
    default:
      return plane(from.plane());
  }
}

Motion motion(const v1::Wall& from) {
  switch (from.motion_case()) {
    case v1::Wall::kTranslating:
      return Translation{vec(from.translating().velocity())};
    case v1::Wall::kRotating:
      return Rotation{vec(from.rotating().point()), direction(from.rotating().axis()), from.rotating().rate()};
    case v1::Wall::kVibrating:
      return Vibration{vec(from.vibrating().amplitude()), from.vibrating().frequency(), from.vibrating().phase()};
    case v1::Wall::kTable: {
      Course course;
      for (const v1::TableKnot& knot : from.table().knots()) course.knots.push_back({knot.time(), vec(knot.displacement())});
      return course;
    }
    default:
      return Still{};
  }
}

// A panel as particles meet it: a sheet of two facets. Where it ends on a face of the box it goes on beyond, so that there is
// no rim to be touched, and across periodic faces it closes.
Wall sheet(const v1::Panel& panel, const v1::Lengths& size, const std::string& name) {
  Vec3 low = vec(panel.low()), high = vec(panel.high());
  const Vec3 box{size.x(), size.y(), size.z()};
  int normal = 0;
  for (int d = 0; d < 3; ++d) {
    if (low[d] == high[d]) {
      normal = d;
      continue;
    }
    if (low[d] <= 1e-9 * box[d]) low[d] = -box[d];
    if (high[d] >= (1 - 1e-9) * box[d]) high[d] = 2 * box[d];
  }
  Vec3 one = low, other = high;
  one[(normal + 1) % 3] = high[(normal + 1) % 3];
  other[(normal + 1) % 3] = low[(normal + 1) % 3];
  return {name, Mesh({Facet::of({low, one, high}), Facet::of({low, high, other})}), Still{}};
}

}  // namespace

std::vector<Wall> wall_scene(const v1::Case& from) {
  const v1::Lengths& size = from.domain().size();
  const v1::Cells& cells = from.domain().cells();
  std::vector<Wall> walls;
  for (const v1::Wall& wall : from.walls()) {
    Surface shape = surface(wall);
    if (wall.cut_cells()) {
      const std::array<int, 3> count{static_cast<int>(cells.x()), static_cast<int>(cells.y()), static_cast<int>(cells.z())};
      shape = Mesh(cut_cells(shape, count, {size.x() / count[0], size.y() / count[1], size.z() / count[2]}));
    }
    walls.push_back({wall.name(), std::move(shape), motion(wall)});
  }
  if (!from.has_particles()) return walls;
  for (int i = 0; i < from.domain().panels_size(); ++i)
    walls.push_back(sheet(from.domain().panels(i), size, "domain.panels[" + std::to_string(i) + "]"));
  return walls;
}

}  // namespace bedflow
