#include <algorithm>

#include "case_rules.h"
#include "parameter_text.h"

namespace bedflow {
namespace {

// Calls rule(face, its name, its axis) for the faces that are set; their fields come in the order x_low, x_high, y_low …
template <typename Rule>
void for_each_face(const v1::Case& value, Rule rule) {
  const v1::Faces& faces = value.domain().faces();
  const auto& type = *v1::Faces::descriptor();
  for (int i = 0; i < type.field_count(); ++i) {
    if (!faces.GetReflection()->HasField(faces, type.field(i))) continue;
    const auto& face = static_cast<const v1::Face&>(faces.GetReflection()->GetMessage(faces, type.field(i)));
    rule(face, "domain.faces." + type.field(i)->name(), static_cast<std::size_t>(i / 2));
  }
}

void check_wall(const v1::Face& face, const std::string& path, std::size_t axis, CaseFaults& faults) {
  const double normal = component(face.no_slip_wall().velocity(), axis);
  if (face.has_no_slip_wall() && normal != 0) {
    faults.push_back({path + ".no_slip_wall.velocity." + axis_names[axis],
                      "is " + number_text(normal) + " m/s, normal to the face: a wall of the box can slide only; set it to 0"});
  }
}

void check_patches(const v1::Case& value, const v1::Face& face, const std::string& path, std::size_t axis, CaseFaults& faults) {
  for (int i = 0; i < face.inflow().patches_size(); ++i) {
    const v1::Patch& patch = face.inflow().patches(i);
    if (!patch.has_low() || !patch.has_high()) continue;
    for (std::size_t along = 0; along < 3; ++along) {
      if (along != axis) check_extent(value, patch.low(), patch.high(), along, item_path(path + ".inflow.patches", i), faults);
    }
  }
  const v1::Box& rectangle = face.mass_inflow().rectangle();
  if (!rectangle.has_low() || !rectangle.has_high()) return;
  for (std::size_t along = 0; along < 3; ++along) {
    if (along != axis) check_extent(value, rectangle.low(), rectangle.high(), along, path + ".mass_inflow.rectangle", faults);
  }
}

// Of Inflow or Patch: a ramp or a schedule.
template <typename Jet>
void check_course(const Jet& jet, const std::string& path, CaseFaults& faults) {
  check_schedule(jet.schedule(), path, faults);
  if (jet.has_ramp() && jet.schedule_size() > 0) {
    faults.push_back({path + ".ramp", "is set, and so is schedule: remove one of the two"});
  }
}

void check_courses(const v1::Face& face, const std::string& path, CaseFaults& faults) {
  check_course(face.inflow(), path + ".inflow", faults);
  for (int i = 0; i < face.inflow().patches_size(); ++i) {
    check_course(face.inflow().patches(i), item_path(path + ".inflow.patches", i), faults);
  }
  check_schedule(face.mass_inflow().schedule(), path + ".mass_inflow", faults);
}

double widest(const v1::Particles& particles, const TypeShares& types) {
  if (types.empty()) return largest_diameter(particles);
  double widest = 0;
  for (const v1::TypeShare& share : types)
    if (const v1::ParticleType* type = type_named(particles, share.type())) widest = std::max(widest, largest_diameter(*type));
  return widest;
}

void check_inflow_patch(const v1::Case& value, const v1::ParticleInflow& inflow, const std::string& path, std::size_t axis,
                        CaseFaults& faults) {
  if (!inflow.patch().has_low() || !inflow.patch().has_high()) return;
  const double diameter = widest(value.particles(), inflow.types());
  for (std::size_t along = 0; along < 3; ++along) {
    if (along == axis) continue;
    check_extent(value, inflow.patch().low(), inflow.patch().high(), along, path + ".patch", faults);
    const double edge = component(inflow.patch().high(), along) - component(inflow.patch().low(), along);
    if (!(edge > 0) || edge >= diameter) continue;
    faults.push_back({path + ".patch.high." + axis_names[along], "leaves the patch " + number_text(edge) + " m along " +
                                                                     axis_names[along] + ": particles as large as " +
                                                                     number_text(diameter) + " m must fit through"});
  }
}

void check_particle_inflow(const v1::Case& value, const v1::ParticleInflow& inflow, const std::string& path, std::size_t axis,
                           bool high, CaseFaults& faults) {
  if (inflow.has_mass_rate() == inflow.has_number_rate()) {
    faults.push_back({path + ".mass_rate", inflow.has_mass_rate() ? "is set, and so is number_rate: remove one of the two"
                                                                  : "is missing, and so is number_rate: set one of the two"});
  }
  const double inward = component(inflow.velocity(), axis) * (high ? -1 : 1);
  if (inflow.has_velocity() && !(inward > 0)) {
    faults.push_back({path + ".velocity." + axis_names[axis], "is " + number_text(component(inflow.velocity(), axis)) +
                                                                  " m/s: to come in through this face it must be " +
                                                                  (high ? "below 0" : "above 0")});
  }
  if (inflow.has_until() && !(inflow.until() > inflow.from())) {
    faults.push_back({path + ".until",
                      "is " + number_text(inflow.until()) + " s: it must be after from, " + number_text(inflow.from()) + " s"});
  }
  check_shares(value.particles(), inflow.types(), path + ".types", faults);
  check_inflow_patch(value, inflow, path, axis, faults);
}

void check_particles_at(const v1::Case& value, const v1::Face& face, const std::string& path, std::size_t axis,
                        CaseFaults& faults) {
  for (int i = 0; i < face.particle_inflows_size(); ++i)
    check_particle_inflow(value, face.particle_inflows(i), item_path(path + ".particle_inflows", i), axis, path.ends_with("high"),
                          faults);
  if (face.particle_inflows_size() > 0 && !value.has_particles()) {
    faults.push_back({path + ".particle_inflows",
                      "lets particles in, but the case has no particles: add them, with empty {} if "
                      "none is there at time 0"});
  }
  if (face.outflow().screen() && face.outflow().particles() == v1::LEAVE) {
    faults.push_back({path + ".outflow.particles", "is LEAVE, but screen is true and holds them back: remove one of the two"});
  }
}

bool lets_gas_in(const v1::Inflow& inflow) {
  bool flows = inflow.velocity() > 0 || inflow.ramp().from() > 0;
  for (const v1::Patch& patch : inflow.patches()) flows = flows || patch.velocity() > 0 || patch.ramp().from() > 0;
  return flows;
}

}  // namespace

void check_faces(const v1::Case& value, CaseFaults& faults) {
  std::string inflow;  // path of one that lets gas in
  bool has_outflow = false;
  for_each_face(value, [&](const v1::Face& face, const std::string& path, std::size_t axis) {
    if (component(value.domain().periodic(), axis)) {
      faults.push_back(
          {path, "is set, but domain.periodic." + std::string(axis_names[axis]) + " is true: remove one of the two"});
    }
    check_wall(face, path, axis, faults);
    check_patches(value, face, path, axis, faults);
    check_courses(face, path, faults);
    check_particles_at(value, face, path, axis, faults);
    if (face.has_inflow() && lets_gas_in(face.inflow())) inflow = path + ".inflow";
    if (face.mass_inflow().mass_flow() > 0) inflow = path + ".mass_inflow";
    has_outflow = has_outflow || face.has_outflow();
  });
  if (value.has_gas() && !inflow.empty() && !has_outflow) {
    faults.push_back({inflow, "lets gas in, but no face of domain.faces lets it out: set outflow on one, such as y_high"});
  }
}

}  // namespace bedflow
