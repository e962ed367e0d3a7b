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
    if (face.has_inflow() && lets_gas_in(face.inflow())) inflow = path + ".inflow";
    has_outflow = has_outflow || face.has_outflow();
  });
  if (value.has_gas() && !inflow.empty() && !has_outflow) {
    faults.push_back({inflow, "lets gas in, but no face of domain.faces lets it out: set outflow on one, such as y_high"});
  }
}

}  // namespace bedflow
