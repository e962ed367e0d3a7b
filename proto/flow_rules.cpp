// What drives the gas and stands in its way inside the box: courses in time, driven periodic directions, panels.
#include <algorithm>
#include <cmath>

#include "case_rules.h"
#include "parameter_text.h"

namespace bedflow {
namespace {

std::string name_of(const std::string& path, std::size_t axis) {
  return path + "." + axis_names[axis];
}

void check_driving(const v1::Case& value, CaseFaults& faults) {
  const v1::Driving& driving = value.gas().driving();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool given = axis == 0 ? driving.has_x() : axis == 1 ? driving.has_y() : driving.has_z();
    if (!given) continue;
    const v1::Drive& drive = component(driving, axis);
    const std::string path = name_of("gas.driving", axis);
    if (!component(value.domain().periodic(), axis)) {
      faults.push_back({path, "is set, but domain.periodic." + std::string(axis_names[axis]) +
                                  " is false: between faces these drive the gas; make the direction periodic or remove it"});
    }
    if (drive.has_pressure_drop() == drive.has_mass_flux()) {
      faults.push_back({path + ".pressure_drop", drive.has_mass_flux() ? "is set, and so is mass_flux: remove one of the two"
                                                                       : "is missing, and so is mass_flux: set one of the two"});
    }
    check_schedule(drive.schedule(), path, faults);
  }
}

// Place of a corner along an axis in cells of the grid; reports one that is not on a line of it.
void check_on_grid(const v1::Case& value, const v1::Vector& corner, std::size_t axis, const std::string& path,
                   CaseFaults& faults) {
  const double cell = component(value.domain().size(), axis) / component(value.domain().cells(), axis);
  const double place = component(corner, axis) / cell, nearest = std::round(place);
  if (!std::isfinite(place) || std::abs(place - nearest) < 1e-6) return;
  faults.push_back({name_of(path, axis), "is " + number_text(component(corner, axis)) + " m, between the lines of the grid (" +
                                             name_of("domain.cells", axis) + "): the nearest is " + number_text(nearest * cell) +
                                             " m"});
}

void check_panel(const v1::Case& value, const v1::Panel& panel, const std::string& path, CaseFaults& faults) {
  if (!panel.has_low() || !panel.has_high()) return;
  std::size_t normals = 0, normal = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (component(panel.low(), axis) != component(panel.high(), axis)) continue;
    normal = axis;
    ++normals;
  }
  if (normals != 1) {
    faults.push_back(
        {path + ".high", "differs from low along " + std::to_string(3 - normals) +
                             " directions: a panel is a rectangle, flat along one of x, y and z and wide along two"});
    return;
  }
  const double place = component(panel.low(), normal), size = component(value.domain().size(), normal);
  if (size > 0 && !(place > 0 && place < size)) {
    faults.push_back({name_of(path + ".low", normal), "is " + number_text(place) +
                                                          " m: a panel lies inside the box, between 0 and " +
                                                          name_of("domain.size", normal) + ", " + number_text(size) + " m"});
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axis != normal) check_extent(value, panel.low(), panel.high(), axis, path, faults);
    if (!value.domain().has_cells()) continue;
    check_on_grid(value, panel.low(), axis, path + ".low", faults);
    if (axis != normal) check_on_grid(value, panel.high(), axis, path + ".high", faults);
  }
  if (panel.has_baffle() && component(value.gas().driving(), normal).has_mass_flux()) {
    faults.push_back({path + ".baffle", "stands across the flux that " + name_of("gas.driving", normal) +
                                            ".mass_flux holds: drive that direction by pressure_drop"});
  }
}

std::size_t normal_of(const v1::Panel& panel) {
  std::size_t normal = 0;
  while (normal < 2 && component(panel.low(), normal) != component(panel.high(), normal)) ++normal;
  return normal;
}

bool overlap(const v1::Panel& a, const v1::Panel& b, std::size_t normal) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool apart =
        component(a.low(), axis) >= component(b.high(), axis) || component(b.low(), axis) >= component(a.high(), axis);
    if (axis != normal && apart) return false;
  }
  return true;
}

// What the transfer between particles and gas asks: on either side of a baffle a face to which a particle's share can go.
void check_panels_beside_particles(const v1::Case& value, CaseFaults& faults) {
  const auto& panels = value.domain().panels();
  if (!panels.empty() && value.coupling().has_gaussian()) {
    faults.push_back(
        {"coupling.gaussian", "spreads particles through domain.panels: choose another kernel, or remove the panels"});
  }
  for (int i = 0; i < panels.size(); ++i) {
    if (!panels[i].has_baffle()) continue;
    const std::size_t normal = normal_of(panels[i]);
    const double size = component(value.domain().size(), normal), cell = size / component(value.domain().cells(), normal);
    const double place = component(panels[i].low(), normal), least = 1.5 * cell;
    const std::string path = item_path("domain.panels", i) + ".baffle";
    if (!component(value.domain().periodic(), normal) && std::min(place, size - place) < least) {
      faults.push_back({path,
                        "stands one cell from a face of the box, too near for particles between them to act on the gas: "
                        "move it by a cell"});
    }
    for (int j = 0; j < i; ++j) {
      if (!panels[j].has_baffle() || normal_of(panels[j]) != normal || !overlap(panels[i], panels[j], normal)) continue;
      const double apart = std::abs(place - component(panels[j].low(), normal));
      if (apart == 0 || apart > least) continue;
      faults.push_back({path, "stands one cell from " + item_path("domain.panels", j) +
                                  ", too near for particles between them to act on the gas: move it by a cell"});
    }
  }
}

}  // namespace

void check_schedule(const Instants& schedule, const std::string& path, CaseFaults& faults) {
  for (int i = 1; i < schedule.size(); ++i) {
    if (schedule[i].time() > schedule[i - 1].time()) continue;
    faults.push_back({item_path(path + ".schedule", i) + ".time", "is " + number_text(schedule[i].time()) +
                                                                      " s, not after the instant before it, " +
                                                                      number_text(schedule[i - 1].time()) + " s"});
  }
}

void check_flow(const v1::Case& value, CaseFaults& faults) {
  check_driving(value, faults);
  for (int i = 0; i < value.domain().panels_size(); ++i) {
    check_panel(value, value.domain().panels(i), item_path("domain.panels", i), faults);
  }
  if (value.has_coupling() && value.domain().has_cells()) check_panels_beside_particles(value, faults);
}

}  // namespace bedflow
