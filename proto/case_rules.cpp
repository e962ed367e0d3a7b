#include "case_rules.h"

#include <algorithm>
#include <cmath>

#include "parameter_text.h"

namespace bedflow {
namespace {

void check_parts(const v1::Case& value, CaseFaults& faults) {
  if (!value.has_gas() && !value.has_particles()) {
    faults.push_back({"gas", "is missing, and so is particles: a scene needs at least one of them"});
  }
  if (value.has_gas() && value.has_particles() && !value.has_coupling()) {
    faults.push_back({"coupling", "is missing: gas and particles are both there; set drag, kernel and exchange in coupling"});
  }
  if (value.has_coupling() && !(value.has_gas() && value.has_particles())) {
    const std::string absent = value.has_gas() ? "particles" : (value.has_particles() ? "gas" : "gas and particles");
    faults.push_back({"coupling", "needs gas and particles, but the case has no " + absent + ": remove coupling or add them"});
  }
  if (value.has_gas() && value.has_domain() && !value.domain().has_cells()) {
    faults.push_back({"domain.cells", "is missing: the gas (gas) needs a grid; set the cells in each direction"});
  }
}

void check_time(const v1::Case& value, CaseFaults& faults) {
  const v1::Time& time = value.time();
  if (!value.has_time()) return;
  if (time.has_substeps() && (time.has_step() || !value.has_particles())) {
    faults.push_back({"time.substeps", time.has_step() ? "is set, and so is time.step: remove one of the two"
                                                       : "is set, but the case has no particles: set time.step in s"});
  } else if (!time.has_step() && !value.has_particles()) {
    faults.push_back(
        {"time.step", "is missing: without particles there is no collision time to take it from; set the gas step in s"});
  }
  if (time.has_longest_step() && time.has_step() && time.longest_step() < time.step()) {
    faults.push_back({"time.longest_step", "is " + number_text(time.longest_step()) + " s, shorter than time.step, " +
                                               number_text(time.step()) + " s: make it longer"});
  }
  if (time.has_step() && time.has_shortest_step() && time.shortest_step() > time.step()) {
    faults.push_back({"time.shortest_step", "is " + number_text(time.shortest_step()) + " s, longer than time.step, " +
                                                number_text(time.step()) + " s: make it shorter"});
  }
}

// How narrow a cell may be for the chosen kernel, in diameters; 0: it does not matter.
double narrowest_cell(const v1::Coupling& coupling) {
  if (coupling.has_hat() || coupling.has_garg()) return 0.5;  // its base, two cells, is not narrower than the particle
  if (coupling.has_square_dpvm()) return 0.34 * coupling.square_dpvm().width();  // a cube over four cells at most
  return 0;
}

// And a cell must hold one particle's worth of volume with room to spare, Δ* = ∛(dx dy dz)/d ≥ 1, or ε falls to 0 in it.
void check_cells_against_diameter(const v1::Case& value, CaseFaults& faults) {
  if (!value.has_gas() || !value.has_particles() || !value.domain().has_cells()) return;
  const double diameter = largest_diameter(value.particles()), narrowest = narrowest_cell(value.coupling());
  if (narrowest == 0) return;
  const std::string d =
      (value.particles().types_size() > 0 ? "the largest diameter, " : "particles.diameter, ") + number_text(diameter) + " m";
  const std::string kernel = "the kernel coupling." + std::string(value.coupling().has_hat()    ? "hat"
                                                                  : value.coupling().has_garg() ? "garg"
                                                                                                : "square_dpvm");
  double volume = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double length = component(value.domain().size(), axis);
    const double edge = length / component(value.domain().cells(), axis);
    volume *= edge;
    if (!(length > 0) || !(edge < narrowest * diameter)) continue;
    const double most = std::floor(length / (narrowest * diameter));
    faults.push_back({"domain.cells." + std::string(axis_names[axis]),
                      "makes cells of " + number_text(edge) + " m, but " + kernel + " needs at least " + number_text(narrowest) +
                          " of " + d + ": " +
                          (most >= 1 ? "use at most " + number_text(most) + ", or coupling.gaussian"
                                     : "make domain.size." + std::string(axis_names[axis]) + " larger")});
  }
  const double ratio = std::cbrt(volume) / diameter;
  if (!(volume > 0) || !(ratio < 1)) return;
  faults.push_back({"domain.cells", "makes cells of " + number_text(std::round(ratio * 1e3) / 1e3) +
                                        " diameters (cube root of their volume over " + d + "): " + kernel +
                                        " needs at least 1; use fewer cells, or coupling.gaussian"});
}

void check_viscosity(const v1::Case& value, CaseFaults& faults) {
  const v1::Coupling& coupling = value.coupling();
  if (!value.has_gas() || !value.has_particles() || !value.gas().has_viscosity() || value.gas().viscosity() != 0) return;
  if (coupling.drag_case() == v1::Coupling::DRAG_NOT_SET || coupling.has_constant_drag()) return;
  faults.push_back({"gas.viscosity", "is 0 Pa·s, but the law chosen in coupling.drag divides by it: set it above 0"});
}

}  // namespace

void check_scene(const v1::Case& value, CaseFaults& faults) {
  check_parts(value, faults);
  check_time(value, faults);
  check_cells_against_diameter(value, faults);
  check_viscosity(value, faults);
}

void check_extent(const v1::Case& value, const v1::Vector& low, const v1::Vector& high, std::size_t axis, const std::string& path,
                  CaseFaults& faults) {
  const double from = component(low, axis);
  const double to = component(high, axis);
  const double size = component(value.domain().size(), axis);
  const std::string name = axis_names[axis];
  if (from >= to) {
    faults.push_back({path + ".high." + name,
                      "is " + number_text(to) + " m, not above " + path + ".low." + name + ", " + number_text(from) + " m"});
  }
  if (size > 0 && to > size * (1 + 1e-12)) {
    faults.push_back({path + ".high." + name, "is " + number_text(to) + " m, outside the domain: at most domain.size." + name +
                                                  ", " + number_text(size) + " m"});
  }
}

}  // namespace bedflow
