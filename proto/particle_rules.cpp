#include <algorithm>
#include <limits>
#include <set>

#include "case_rules.h"
#include "parameter_text.h"

namespace bedflow {
namespace {

struct Range {
  double smallest = 0, largest = 0;  // m; 0 where the case does not say
};

Range range_of(const v1::ParticleType& type) {
  switch (type.sizes_case()) {
    case v1::ParticleType::kConstant:
      return {type.constant().diameter(), type.constant().diameter()};
    case v1::ParticleType::kUniform:
      return {type.uniform().smallest(), type.uniform().largest()};
    case v1::ParticleType::kNormal:
      return {type.normal().smallest(), type.normal().largest()};
    case v1::ParticleType::kLogNormal:
      return {type.log_normal().smallest(), type.log_normal().largest()};
    case v1::ParticleType::kDiscrete: {
      Range range;
      for (const v1::SizeClass& size : type.discrete().classes()) {
        range.largest = std::max(range.largest, size.diameter());
        range.smallest = range.smallest > 0 ? std::min(range.smallest, size.diameter()) : size.diameter();
      }
      return range;
    }
    case v1::ParticleType::kHistogram: {
      const auto& classes = type.histogram().classes();
      return {type.histogram().smallest(), classes.empty() ? 0 : classes[classes.size() - 1].diameter()};
    }
    default:
      return {};
  }
}

// One kind of particle is told by diameter and density, several by types: one of the two ways.
void check_kinds(const v1::Particles& particles, CaseFaults& faults) {
  const bool types = particles.types_size() > 0;
  const auto check = [&](const char* name, bool given, const char* what) {
    const std::string path = std::string("particles.") + name;
    if (given && types)
      faults.push_back({path, "is set, and so is particles.types, where each type has its own: remove one of the two"});
    if (!given && !types)
      faults.push_back({path, std::string("is missing: ") + what + "; set it, or particles.types for several types or sizes"});
  };
  check("diameter", particles.has_diameter(), "the diameter of the particles, in m");
  check("density", particles.has_density(), "the density of the solid, in kg/m³");
}

void check_order(double smallest, double largest, const std::string& path, CaseFaults& faults) {
  if (smallest > 0 && largest > 0 && !(smallest < largest)) {
    faults.push_back({path + ".largest", "is " + number_text(largest) + " m: it must be above " + path + ".smallest, " +
                                             number_text(smallest) + " m (for one size set constant)"});
  }
}

void check_middle(double middle, const char* name, double smallest, double largest, const std::string& path, CaseFaults& faults) {
  if (!(middle > 0) || !(smallest < largest) || (middle > smallest && middle < largest)) return;
  faults.push_back({path + "." + name, "is " + number_text(middle) + " m: it must be between smallest, " + number_text(smallest) +
                                           " m, and largest, " + number_text(largest) + " m"});
}

template <class Items>
void check_sum(const Items& items, const std::string& path, CaseFaults& faults) {
  if (items.empty() || std::ranges::any_of(items, [](const auto& item) { return !item.has_share() || item.share() != 0; }))
    return;
  faults.push_back({path, "has shares that are all 0: set at least one above 0"});
}

void check_classes(const v1::ParticleType& type, const std::string& path, CaseFaults& faults) {
  const bool histogram = type.has_histogram();
  const auto& classes = histogram ? type.histogram().classes() : type.discrete().classes();
  const std::string list = path + (histogram ? ".histogram.classes" : ".discrete.classes");
  check_sum(classes, list, faults);
  double before = histogram ? type.histogram().smallest() : 0;
  for (int i = 0; histogram && i < classes.size(); ++i) {
    const double diameter = classes[i].diameter();
    if (before > 0 && diameter > 0 && !(diameter > before)) {
      faults.push_back({item_path(list, i) + ".diameter",
                        "is " + number_text(diameter) + " m: the classes must rise, it must be above " + number_text(before) +
                            " m, " + (i == 0 ? "histogram.smallest" : "the diameter of the class before")});
    }
    before = diameter;
  }
}

void check_sizes(const v1::ParticleType& type, const std::string& path, CaseFaults& faults) {
  const auto [smallest, largest] = range_of(type);
  if (type.has_uniform()) check_order(smallest, largest, path + ".uniform", faults);
  if (type.has_normal()) {
    check_order(smallest, largest, path + ".normal", faults);
    check_middle(type.normal().mean(), "mean", smallest, largest, path + ".normal", faults);
  }
  if (type.has_log_normal()) {
    check_order(smallest, largest, path + ".log_normal", faults);
    check_middle(type.log_normal().median(), "median", smallest, largest, path + ".log_normal", faults);
  }
  if (type.has_discrete() || type.has_histogram()) check_classes(type, path, faults);
}

void check_types(const v1::Particles& particles, CaseFaults& faults) {
  std::set<std::string> names;
  for (int i = 0; i < particles.types_size(); ++i) {
    const v1::ParticleType& type = particles.types(i);
    const std::string path = item_path("particles.types", i);
    if (!type.name().empty() && !names.insert(type.name()).second)
      faults.push_back({path + ".name", "is \"" + type.name() + "\", the name of another type: give each its own"});
    check_sizes(type, path, faults);
  }
  check_sum(particles.types(), "particles.types", faults);
}

// Where the largest diameter is said.
std::string largest_path(const v1::Particles& particles) {
  for (int i = 0; i < particles.types_size(); ++i)
    if (range_of(particles.types(i)).largest == largest_diameter(particles)) return item_path("particles.types", i);
  return "particles.diameter";
}

void check_diameter(const v1::Case& value, CaseFaults& faults) {
  const double diameter = largest_diameter(value.particles());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double size = component(value.domain().size(), axis);
    if (!(size > 0) || !(diameter > size)) continue;
    faults.push_back({largest_path(value.particles()), "is " + number_text(diameter) +
                                                           " m, larger than the domain: at most domain.size." + axis_names[axis] +
                                                           ", " + number_text(size) + " m"});
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

}  // namespace

double largest_diameter(const v1::Particles& particles) {
  double largest = particles.diameter();
  for (const v1::ParticleType& type : particles.types()) largest = std::max(largest, range_of(type).largest);
  return largest;
}

double smallest_diameter(const v1::ParticleType& type) {
  return range_of(type).smallest;
}

double largest_diameter(const v1::ParticleType& type) {
  return range_of(type).largest;
}

const v1::ParticleType* type_named(const v1::Particles& particles, const std::string& name) {
  const auto found = std::ranges::find(particles.types(), name, [](const v1::ParticleType& type) { return type.name(); });
  return found == particles.types().end() ? nullptr : &*found;
}

void check_type_name(const v1::Particles& particles, const std::string& name, const std::string& path, CaseFaults& faults) {
  if (name.empty() || type_named(particles, name) != nullptr) return;
  std::string names;
  for (const v1::ParticleType& type : particles.types()) names += (names.empty() ? "" : ", ") + type.name();
  faults.push_back(
      {path, "is \"" + name + "\", but " +
                 (names.empty() ? "the case has no particles.types: remove it" : "the types in particles.types are " + names)});
}

void check_shares(const v1::Particles& particles, const TypeShares& shares, const std::string& path, CaseFaults& faults) {
  std::set<std::string> names;
  for (int i = 0; i < shares.size(); ++i) {
    const std::string item = item_path(path, i) + ".type";
    check_type_name(particles, shares[i].type(), item, faults);
    if (!shares[i].type().empty() && !names.insert(shares[i].type()).second)
      faults.push_back({item, "is \"" + shares[i].type() + "\" again: name each type once"});
  }
  check_sum(shares, path, faults);
}

void check_particles(const v1::Case& value, CaseFaults& faults) {
  if (!value.has_particles()) return;
  check_kinds(value.particles(), faults);
  check_types(value.particles(), faults);
  check_diameter(value, faults);
  check_skin(value, faults);
}

}  // namespace bedflow
