#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "case_rules.h"
#include "parameter_text.h"

namespace bedflow {
namespace {

// Random placing without overlap: beyond this solids fraction it takes too many tries (saturation is near 0.38).
constexpr double densest_random_fraction = 0.35;
// The closest that neighbours of a lattice may be, in diameters: a slight overlap is a preloaded packing, more is a mistake.
constexpr double closest_lattice = 0.9;

double edge_of(const v1::Box& box, std::size_t axis) {
  return component(box.high(), axis) - component(box.low(), axis);
}

v1::Box whole_domain(const v1::Case& value) {
  v1::Box box;
  box.mutable_high()->set_x(value.domain().size().x());
  box.mutable_high()->set_y(value.domain().size().y());
  box.mutable_high()->set_z(value.domain().size().z());
  return box;
}

void check_diameter(const v1::Case& value, CaseFaults& faults) {
  const double diameter = value.particles().diameter();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double size = component(value.domain().size(), axis);
    if (!(size > 0) || !(diameter > size)) continue;
    faults.push_back({"particles.diameter", "is " + number_text(diameter) + " m, larger than the domain: at most domain.size." +
                                                axis_names[axis] + ", " + number_text(size) + " m"});
  }
}

void check_skin(const v1::Case& value, CaseFaults& faults) {
  const v1::Lengths& size = value.domain().size();
  const double half = 0.5 * std::min({size.x(), size.y(), size.z()});
  const double skin = value.particles().skin();
  if (value.particles().has_skin() && half > 0 && skin >= half) {
    faults.push_back({"particles.skin", "is " + number_text(skin) +
                                            " m: it must be below half of the smallest edge of domain.size, " +
                                            number_text(half) + " m"});
  }
}

void check_region(const v1::Case& value, const v1::Box& region, const std::string& path, CaseFaults& faults) {
  if (!region.has_low() || !region.has_high()) return;
  const double diameter = value.particles().diameter();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    check_extent(value, region.low(), region.high(), axis, path, faults);
    const double edge = edge_of(region, axis);
    if (edge > 0 && edge < diameter) {
      faults.push_back({path + ".high." + axis_names[axis], "leaves the region " + number_text(edge) + " m along " +
                                                                axis_names[axis] + ": at least particles.diameter, " +
                                                                number_text(diameter) + " m, is needed"});
    }
  }
}

void check_random_count(const v1::Case& value, const v1::Box& region, CaseFaults& faults) {
  const double d = value.particles().diameter();
  const double volume = edge_of(region, 0) * edge_of(region, 1) * edge_of(region, 2);
  const double sphere = std::numbers::pi / 6 * d * d * d;
  const double fraction = value.particles().random().count() * sphere / volume;
  if (!(volume > 0) || !(d > 0) || !(fraction > densest_random_fraction)) return;
  faults.push_back({"particles.random.count", "is " + std::to_string(value.particles().random().count()) +
                                                  ", a solids fraction of " + number_text(std::round(fraction * 1e3) / 1e3) +
                                                  " in particles.random.region: random placing reaches " +
                                                  number_text(densest_random_fraction) + ", which is " +
                                                  number_text(std::floor(densest_random_fraction * volume / sphere)) +
                                                  " particles; make the region higher, or place fewer"});
}

void check_settling(const v1::Case& value, CaseFaults& faults) {
  if (!value.particles().random().has_settling() || !value.has_gravity()) return;
  const std::string path = "particles.random.settling";
  bool pulls = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double g = component(value.gravity(), axis);
    pulls = pulls || g != 0;
    if (g != 0 && component(value.domain().periodic(), axis)) {
      faults.push_back({path, "never ends: gravity." + std::string(axis_names[axis]) + " is " + number_text(g) +
                                  " m/s² and domain.periodic." + axis_names[axis] + " is true, so the particles fall for ever"});
    }
  }
  if (!pulls) faults.push_back({path, "needs gravity, but gravity is 0: remove settling or set gravity"});
}

void check_random(const v1::Case& value, CaseFaults& faults) {
  const v1::RandomSeeding& random = value.particles().random();
  if (random.has_region()) check_region(value, random.region(), "particles.random.region", faults);
  check_random_count(value, random.has_region() ? random.region() : whole_domain(value), faults);
  check_settling(value, faults);
}

void check_lattice(const v1::Case& value, CaseFaults& faults) {
  const v1::Lattice& lattice = value.particles().lattice();
  if (lattice.has_region()) check_region(value, lattice.region(), "particles.lattice.region", faults);
  const v1::Box region = lattice.has_region() ? lattice.region() : whole_domain(value);
  const double diameter = value.particles().diameter();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t count = component(lattice.count(), axis);
    const double edge = edge_of(region, axis);
    if (count < 2 || !(edge > 0) || !(edge / count < closest_lattice * diameter)) continue;
    faults.push_back({"particles.lattice.count." + std::string(axis_names[axis]),
                      "is " + std::to_string(count) + ", a spacing of " + number_text(edge / count) + " m: at least " +
                          number_text(closest_lattice) + " of particles.diameter, " + number_text(diameter) +
                          " m, is needed; use at most " + number_text(std::floor(edge / diameter * (1 + 1e-9)))});
  }
}

std::string sphere_path(int index) {
  return item_path("particles.placed.spheres", index) + ".position";
}

void check_centres(const v1::Case& value, CaseFaults& faults) {
  const auto& spheres = value.particles().placed().spheres();
  for (int i = 0; i < spheres.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double x = component(spheres[i].position(), axis);
      const double size = component(value.domain().size(), axis);
      if (!(x > size)) continue;
      faults.push_back({sphere_path(i) + "." + axis_names[axis], "is " + number_text(x) +
                                                                     " m, outside the domain: at most domain.size." +
                                                                     axis_names[axis] + ", " + number_text(size) + " m"});
    }
  }
}

// Two centres at one point have no normal between them; any other overlap is allowed, as a preloaded contact.
void check_coincidence(const v1::Case& value, CaseFaults& faults) {
  const auto& spheres = value.particles().placed().spheres();
  const auto place = [&](int i) {
    const v1::Vector& p = spheres[i].position();
    return std::array{p.x(), p.y(), p.z()};
  };
  std::vector<int> order;
  for (int i = 0; i < spheres.size(); ++i) {
    const auto p = place(i);
    if (spheres[i].has_position() && std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2])) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return place(a) < place(b); });
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (place(order[k - 1]) != place(order[k])) continue;
    faults.push_back({sphere_path(order[k]), "is the same point as " + sphere_path(order[k - 1]) + ": move one of them"});
  }
}

}  // namespace

void check_particles(const v1::Case& value, CaseFaults& faults) {
  if (!value.has_particles()) return;
  check_diameter(value, faults);
  check_skin(value, faults);
  if (value.particles().has_random()) check_random(value, faults);
  if (value.particles().has_lattice()) check_lattice(value, faults);
  if (value.particles().has_placed()) {
    check_centres(value, faults);
    check_coincidence(value, faults);
  }
}

}  // namespace bedflow
