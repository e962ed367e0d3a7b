#include <map>

#include "case_rules.h"
#include "parameter_text.h"
#include "stl.h"

namespace bedflow {
namespace {

bool is_zero(const v1::Vector& v) {
  return v.x() == 0 && v.y() == 0 && v.z() == 0;
}
bool same(const v1::Vector& a, const v1::Vector& b) {
  return a.x() == b.x() && a.y() == b.y() && a.z() == b.z();
}

void check_direction(bool given, const v1::Vector& direction, const std::string& path, CaseFaults& faults) {
  if (given && is_zero(direction)) faults.push_back({path, "is 0 in all components: it must have a direction"});
}

// A side can be kept only where the surface divides space in two.
void check_side(v1::WallSide side, bool closed, const std::string& how, const std::string& path, CaseFaults& faults) {
  if (side == v1::EITHER || closed) return;
  faults.push_back({path + ".particles", "is " + v1::WallSide_Name(side) +
                                             ", but the wall is open, so that it has no inside: " + how + ", or set EITHER"});
}

void check_plane(const v1::PlaneWall& plane, const std::string& path, CaseFaults& faults) {
  check_direction(plane.has_normal(), plane.normal(), path + ".normal", faults);
}

void check_box(const v1::BoxWall& box, const std::string& path, CaseFaults& faults) {
  for (std::size_t axis = 0; axis < 3 && box.has_low() && box.has_high(); ++axis) {
    const double low = component(box.low(), axis), high = component(box.high(), axis);
    if (low < high) continue;
    faults.push_back({path + ".high." + axis_names[axis], "is " + number_text(high) + " m, not above " + path + ".low." +
                                                              axis_names[axis] + ", " + number_text(low) + " m"});
  }
}

template <class Wall>
void check_axis(const Wall& wall, const std::string& path, CaseFaults& faults) {
  if (wall.has_from() && wall.has_to() && same(wall.from(), wall.to())) {
    faults.push_back({path + ".to", "is the same point as " + path + ".from: the axis must have a length"});
  }
}

void check_cylinder(const v1::Case& value, const v1::CylinderWall& cylinder, const std::string& path, CaseFaults& faults) {
  check_axis(cylinder, path, faults);
  check_side(cylinder.particles(), cylinder.closed(), "set closed: true", path, faults);
  const double diameter = largest_diameter(value.particles());
  if (cylinder.particles() == v1::INSIDE && cylinder.radius() > 0 && 2 * cylinder.radius() < diameter) {
    faults.push_back({path + ".radius", "is " + number_text(cylinder.radius()) +
                                            " m, less than half of the largest particle's diameter, " + number_text(diameter) +
                                            " m: no particle fits inside"});
  }
}

void check_cone(const v1::ConeWall& cone, const std::string& path, CaseFaults& faults) {
  check_axis(cone, path, faults);
  check_side(cone.particles(), cone.closed(), "set closed: true", path, faults);
  if (cone.has_radius_from() && cone.has_radius_to() && cone.radius_from() == 0 && cone.radius_to() == 0) {
    faults.push_back(
        {path + ".radius_to", "is 0 m, and so is " + path + ".radius_from: that is a line; one of them must be above 0"});
  }
}

void check_profile(const v1::ProfileWall& profile, const std::string& path, CaseFaults& faults) {
  check_direction(profile.has_axis(), profile.axis(), path + ".axis", faults);
  const int count = profile.corners_size();
  if (count < 2) return;
  const bool closed = profile.corners(0).radius() == 0 && profile.corners(count - 1).radius() == 0;
  check_side(profile.particles(), closed, "begin and end the corners with radius 0", path, faults);
  for (int i = 1; i < count; ++i) {
    const v1::ProfileCorner &a = profile.corners(i - 1), &b = profile.corners(i);
    const std::string corner = item_path(path + ".corners", i);
    if (a.radius() == b.radius() && a.height() == b.height()) {
      faults.push_back({corner, "is the same point as the corner before: remove one"});
    } else if (a.radius() == 0 && b.radius() == 0) {
      faults.push_back({corner + ".radius", "is 0 m, as of the corner before: a line on the axis is no surface; remove one"});
    }
  }
}

StlPoint point(const v1::Vector& v) {
  return {v.x(), v.y(), v.z()};
}

void check_mesh(const v1::MeshWall& mesh, const std::string& path, CaseFaults& faults) {
  if (mesh.triangles_size() == 0) {
    faults.push_back({path + ".triangles",
                      mesh.has_file() ? "is empty: the file " + mesh.file() +
                                            " is read together with a case file only; give the case as a file, or the triangles"
                                      : "is empty: set file to an STL file, or give the triangles"});
    return;
  }
  if (mesh.has_file()) faults.push_back({path + ".file", "is set, and so is triangles: remove one of them"});
  std::vector<StlTriangle> triangles;
  for (const v1::Triangle& t : mesh.triangles()) triangles.push_back({point(t.a()), point(t.b()), point(t.c())});
  for (const std::string& fault : mesh_faults(triangles, mesh.open_sheet()))
    faults.push_back({path + (fault.find("a hole") != std::string::npos ? ".open_sheet" : ".triangles"), fault});
}

void check_surface(const v1::Case& value, const v1::Wall& wall, const std::string& path, CaseFaults& faults) {
  if (wall.has_plane()) check_plane(wall.plane(), path + ".plane", faults);
  if (wall.has_box()) check_box(wall.box(), path + ".box", faults);
  if (wall.has_cylinder()) check_cylinder(value, wall.cylinder(), path + ".cylinder", faults);
  if (wall.has_cone()) check_cone(wall.cone(), path + ".cone", faults);
  if (wall.has_profile()) check_profile(wall.profile(), path + ".profile", faults);
  if (wall.has_mesh()) check_mesh(wall.mesh(), path + ".mesh", faults);
}

void check_motion(const v1::Wall& wall, const std::string& path, CaseFaults& faults) {
  if (wall.has_rotating()) check_direction(wall.rotating().has_axis(), wall.rotating().axis(), path + ".rotating.axis", faults);
  for (int i = 1; i < wall.table().knots_size(); ++i) {
    const double before = wall.table().knots(i - 1).time(), time = wall.table().knots(i).time();
    if (time > before) continue;
    faults.push_back({item_path(path + ".table.knots", i) + ".time",
                      "is " + number_text(time) + " s, not later than the one before, " + number_text(before) + " s"});
  }
}

void check_contact(const v1::Case& value, const v1::Wall& wall, const std::string& path, CaseFaults& faults) {
  if (wall.friction() > 0 && value.particles().has_frictionless()) {
    faults.push_back(
        {path + ".friction", "is " + number_text(wall.friction()) +
                                 ", but particles.frictionless is chosen: nothing rubs; choose another tangential law"});
  }
  if (wall.cut_cells() && value.has_domain() && !value.domain().has_cells()) {
    faults.push_back({path + ".cut_cells", "is true, but domain.cells is missing: set the cells that cut the wall"});
  }
}

}  // namespace

void check_walls(const v1::Case& value, CaseFaults& faults) {
  std::map<std::string, int> by_name;
  for (int i = 0; i < value.walls_size(); ++i) {
    const v1::Wall& wall = value.walls(i);
    const std::string path = item_path("walls", i);
    if (value.has_gas()) {
      faults.push_back({path, "is \"" + wall.name() +
                                  "\", a wall within the gas, which sees the faces of the box only: remove the "
                                  "wall, or gas and coupling"});
    }
    if (!value.has_particles()) {
      faults.push_back({path, "is \"" + wall.name() + "\", but the case has no particles to touch it: remove the wall"});
    }
    if (is_face(wall.name()))
      faults.push_back({path + ".name", "is \"" + wall.name() + "\", a face of the box: give it another one"});
    const auto [first, is_new] = by_name.emplace(wall.name(), i);
    if (!is_new && !wall.name().empty()) {
      faults.push_back({path + ".name",
                        "is \"" + wall.name() + "\", as " + item_path("walls", first->second) + ".name is: give it another one"});
    }
    check_surface(value, wall, path, faults);
    check_motion(wall, path, faults);
    check_contact(value, wall, path, faults);
  }
}

bool is_face(const std::string& name) {
  const auto* faces = v1::Faces::descriptor();
  return faces->FindFieldByName(name) != nullptr;
}

}  // namespace bedflow
