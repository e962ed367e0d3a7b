#include <algorithm>
#include <map>

#include "case_rules.h"
#include "parameter_text.h"

namespace bedflow {
namespace {

struct Needs {
  bool gas = false;
  bool particles = false;
};

Needs needs_of(v1::Monitor::QuantityCase quantity) {
  switch (quantity) {
    case v1::Monitor::kPressureDrop:
    case v1::Monitor::kMassBalance:
      return {.gas = true, .particles = false};
    case v1::Monitor::kMomentumBalance:
    case v1::Monitor::kVoidFraction:
      return {.gas = true, .particles = true};
    case v1::Monitor::kKineticEnergy:
    case v1::Monitor::kBedHeight:
    case v1::Monitor::kMaxOverlap:
    case v1::Monitor::kParticleCount:
    case v1::Monitor::kParticleVelocity:
    case v1::Monitor::kParticleMomentum:
    case v1::Monitor::kParticleMass:
    case v1::Monitor::kMassEntered:
    case v1::Monitor::kMassLeft:
    case v1::Monitor::kWallForce:
    case v1::Monitor::kWallTorque:
      return {.gas = false, .particles = true};
    case v1::Monitor::QUANTITY_NOT_SET:
      break;
  }
  return {};
}

bool is_profile(const v1::Monitor& monitor) {
  return monitor.has_void_fraction() || monitor.has_particle_velocity();
}

std::string quantity_name(const v1::Monitor& monitor) {
  const auto* field =
      monitor.GetReflection()->GetOneofFieldDescriptor(monitor, v1::Monitor::descriptor()->FindOneofByName("quantity"));
  return field == nullptr ? "quantity" : field->name();
}

// A coordinate that lies beyond the domain along an axis.
void check_inside(const v1::Case& value, double coordinate, std::size_t axis, const std::string& path, CaseFaults& faults) {
  const double size = component(value.domain().size(), axis);
  if (!(coordinate > size)) return;
  faults.push_back({path, "is " + number_text(coordinate) + " m, outside the domain: at most domain.size." + axis_names[axis] +
                              ", " + number_text(size) + " m"});
}

void check_pressure_drop(const v1::Case& value, const v1::PressureDrop& drop, const std::string& path, CaseFaults& faults) {
  check_inside(value, drop.low(), 1, path + ".low", faults);
  check_inside(value, drop.high(), 1, path + ".high", faults);
  if (drop.has_low() && drop.has_high() && drop.low() >= drop.high()) {
    faults.push_back(
        {path + ".high", "is " + number_text(drop.high()) + " m, not above " + path + ".low, " + number_text(drop.low()) + " m"});
  }
}

void check_velocity_profile(const v1::Case& value, const v1::VelocityProfile& profile, const std::string& path,
                            CaseFaults& faults) {
  check_inside(value, profile.height(), 1, path + ".height", faults);
  check_inside(value, profile.depth_high(), 2, path + ".depth_high", faults);
  const double back = profile.has_depth_high() ? profile.depth_high() : value.domain().size().z();
  if (profile.depth_low() >= back) {
    const std::string other = profile.has_depth_high() ? path + ".depth_high" : "domain.size.z";
    faults.push_back({path + ".depth_low", "is " + number_text(profile.depth_low()) + " m, not in front of " + other + ", " +
                                               number_text(back) + " m"});
  }
}

bool is_wall(const v1::Case& value, const std::string& name) {
  return std::any_of(value.walls().begin(), value.walls().end(), [&](const v1::Wall& wall) { return wall.name() == name; });
}

void check_wall_name(const v1::Case& value, const std::string& name, bool faces, const std::string& path, CaseFaults& faults) {
  if (name.empty() || is_wall(value, name) || (faces && is_face(name))) return;
  faults.push_back({path + ".wall", "is \"" + name + "\", but no wall of the case has that name" +
                                        (is_face(name) ? ": of a face of the box there is wall_force only" : "")});
}

void check_quantity(const v1::Case& value, const v1::Monitor& monitor, const std::string& monitor_path, CaseFaults& faults) {
  const std::string path = child_path(monitor_path, quantity_name(monitor));
  const Needs needs = needs_of(monitor.quantity_case());
  if (needs.gas && !value.has_gas()) faults.push_back({path, "observes the gas, but the case has no gas: remove the monitor"});
  if (needs.particles && !value.has_particles()) {
    faults.push_back({path, "observes the particles, but the case has no particles: remove the monitor"});
  }
  if (monitor.has_bed_height()) check_inside(value, monitor.bed_height().above(), 1, path + ".above", faults);
  if (monitor.has_pressure_drop()) check_pressure_drop(value, monitor.pressure_drop(), path, faults);
  if (monitor.has_void_fraction()) check_inside(value, monitor.void_fraction().height(), 1, path + ".height", faults);
  check_type_name(value.particles(), monitor.particle_count().type(), path + ".type", faults);
  check_type_name(value.particles(), monitor.particle_mass().type(), path + ".type", faults);
  if (monitor.has_particle_velocity()) check_velocity_profile(value, monitor.particle_velocity(), path, faults);
  if (monitor.has_wall_force()) check_wall_name(value, monitor.wall_force().wall(), true, path, faults);
  if (monitor.has_wall_torque()) check_wall_name(value, monitor.wall_torque().wall(), false, path, faults);
  if (is_profile(monitor) && !monitor.has_averaging()) {
    faults.push_back({monitor_path + ".averaging", "is missing: a profile keeps averages only; set the length of a bin"});
  }
}

void check_reference(const v1::Reference& reference, const v1::Monitor& monitor, const std::string& path, CaseFaults& faults) {
  for (int i = 0; i < reference.points_size(); ++i) {
    if (!is_profile(monitor) || reference.points(i).has_x()) continue;
    faults.push_back(
        {item_path(path + ".points", i) + ".x",
         "is missing: the monitor " + monitor.name() + " is a profile, and the point has no place on it; set it, in m"});
  }
}

}  // namespace

void check_monitors(const v1::Case& value, CaseFaults& faults) {
  std::map<std::string, int> by_name;
  for (int i = 0; i < value.monitors_size(); ++i) {
    const v1::Monitor& monitor = value.monitors(i);
    check_quantity(value, monitor, item_path("monitors", i), faults);
    const auto [first, is_new] = by_name.emplace(monitor.name(), i);
    if (is_new || monitor.name().empty()) continue;
    faults.push_back(
        {item_path("monitors", i) + ".name",
         "is \"" + monitor.name() + "\", as " + item_path("monitors", first->second) + ".name is: give it another one"});
  }
  for (int i = 0; i < value.references_size(); ++i) {
    const v1::Reference& reference = value.references(i);
    const std::string path = item_path("references", i);
    const auto found = by_name.find(reference.monitor());
    if (found != by_name.end()) {
      check_reference(reference, value.monitors(found->second), path, faults);
    } else if (reference.has_monitor()) {
      faults.push_back({path + ".monitor", "is \"" + reference.monitor() + "\", but no monitor of the case has that name"});
    }
  }
}

}  // namespace bedflow
