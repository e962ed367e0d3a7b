#include <algorithm>
#include <cmath>
#include <numbers>

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

double sphere(double diameter) {
  return std::numbers::pi / 6 * diameter * diameter * diameter;
}

// A region of the case: random, placed or lattice, and the types of it that are named.
class SeedingRules {
 public:
  SeedingRules(const v1::Case& value, std::string path, const TypeShares& types, CaseFaults& faults)
      : value_(value), particles_(value.particles()), path_(std::move(path)), types_(types), faults_(faults) {
    check_shares(particles_, types, path_ + ".types", faults);
  }

  void check_random(const v1::RandomSeeding& random) {
    const std::string path = path_ + ".random";
    if (random.has_region()) check_region(random.region(), path + ".region");
    if (random.has_count() && random.has_solids_fraction()) {
      report(path + ".solids_fraction", "is set, and so is " + path + ".count: remove one of the two");
    } else if (!random.has_count() && !random.has_solids_fraction()) {
      report(path + ".count",
             "is missing: the number of particles; set it, or solids_fraction, the share of the region that they fill");
    }
    check_count(random, random.has_region() ? random.region() : whole_domain(), path);
  }

  void check_lattice(const v1::Lattice& lattice) {
    const std::string path = path_ + ".lattice";
    if (lattice.has_region()) check_region(lattice.region(), path + ".region");
    const v1::Box region = lattice.has_region() ? lattice.region() : whole_domain();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t count = component(lattice.count(), axis);
      const double edge = edge_of(region, axis);
      if (count < 2 || !(edge > 0) || !(edge / count < closest_lattice * largest())) continue;
      report(path + ".count." + axis_names[axis], "is " + std::to_string(count) + ", a spacing of " + number_text(edge / count) +
                                                      " m: at least " + number_text(closest_lattice) + " of " + largest_text() +
                                                      " is needed; use at most " +
                                                      number_text(std::floor(edge / largest() * (1 + 1e-9))));
    }
  }

  void check_placed(const v1::Placed& placed) {
    if (placed.has_file()) {
      report(path_ + ".placed.file",
             "is \"" + placed.file() +
                 "\": a table is read beside a case file, by `bedflow` or the engine, and its lines become "
                 "spheres; name it in the file, and give the file's path");
    }
    for (int i = 0; i < placed.spheres_size(); ++i) check_sphere(placed.spheres(i), item_path(path_ + ".placed.spheres", i));
    check_coincidence(placed);
  }

 private:
  void report(const std::string& path, const std::string& text) { faults_.push_back({path, text}); }

  v1::Box whole_domain() const {
    v1::Box box;
    box.mutable_high()->set_x(value_.domain().size().x());
    box.mutable_high()->set_y(value_.domain().size().y());
    box.mutable_high()->set_z(value_.domain().size().z());
    return box;
  }

  // Calls take(type, share) for the region's types.
  template <class Take>
  void each_type(Take take) const {
    if (types_.empty())
      for (const v1::ParticleType& type : particles_.types()) take(type, type.share());
    for (const v1::TypeShare& share : types_)
      if (const v1::ParticleType* type = type_named(particles_, share.type())) take(*type, share.share());
  }
  double largest() const {
    double largest = particles_.diameter();
    each_type([&](const v1::ParticleType& type, double) { largest = std::max(largest, largest_diameter(type)); });
    return largest;
  }
  std::string largest_text() const {
    return (particles_.types_size() > 0 ? "the largest diameter, " : "particles.diameter, ") + number_text(largest()) + " m,";
  }
  // Mean volume of a particle, from below: each type with its smallest diameter.
  double least_volume() const {
    if (particles_.types_size() == 0) return sphere(particles_.diameter());
    double volume = 0, number = 0;
    each_type([&](const v1::ParticleType& type, double share) {
      const double v = sphere(smallest_diameter(type));
      const double n = particles_.shares_by() == v1::MASS ? share / (v * type.density()) : share;
      volume += n * v;
      number += n;
    });
    return volume / number;
  }

  void check_region(const v1::Box& region, const std::string& path) {
    if (!region.has_low() || !region.has_high()) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      check_extent(value_, region.low(), region.high(), axis, path, faults_);
      const double edge = edge_of(region, axis);
      if (edge > 0 && edge < largest()) {
        report(path + ".high." + axis_names[axis], "leaves the region " + number_text(edge) + " m along " + axis_names[axis] +
                                                       ": at least " + largest_text() + " is needed");
      }
    }
  }

  void check_count(const v1::RandomSeeding& random, const v1::Box& region, const std::string& path) {
    const double volume = edge_of(region, 0) * edge_of(region, 1) * edge_of(region, 2), one = least_volume();
    const double fraction = random.count() * one / volume;
    if (!(volume > 0) || !(one > 0) || !(fraction > densest_random_fraction)) return;
    report(path + ".count", "is " + std::to_string(random.count()) + ", a solids fraction of " +
                                number_text(std::round(fraction * 1e3) / 1e3) + " in " + path +
                                ".region: random placing reaches " + number_text(densest_random_fraction) + ", which is " +
                                number_text(std::floor(densest_random_fraction * volume / one)) +
                                " particles; make the region higher, or place fewer");
  }

  void check_sphere(const v1::Sphere& sphere, const std::string& path) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double x = component(sphere.position(), axis);
      const double size = component(value_.domain().size(), axis);
      if (!(x > size)) continue;
      report(path + ".position." + axis_names[axis], "is " + number_text(x) + " m, outside the domain: at most domain.size." +
                                                         axis_names[axis] + ", " + number_text(size) + " m");
    }
    check_type_name(particles_, sphere.type(), path + ".type", faults_);
    if (!sphere.has_diameter()) return;
    const v1::ParticleType* type =
        sphere.type().empty() && particles_.types_size() > 0 ? &particles_.types(0) : type_named(particles_, sphere.type());
    const double smallest = type ? smallest_diameter(*type) : particles_.diameter();
    const double largest = type ? largest_diameter(*type) : particles_.diameter();
    if (sphere.diameter() >= smallest && sphere.diameter() <= largest) return;
    report(path + ".diameter", "is " + number_text(sphere.diameter()) + " m: " +
                                   (type ? "its type " + type->name() + " has " : std::string("particles.diameter is ")) +
                                   (smallest < largest ? number_text(smallest) + " to " : "") + number_text(largest) + " m");
  }

  // Two centres at one point have no normal between them; any other overlap is allowed, as a preloaded contact.
  void check_coincidence(const v1::Placed& placed) {
    const auto& spheres = placed.spheres();
    const auto place = [&](int i) {
      const v1::Vector& p = spheres[i].position();
      return std::array{p.x(), p.y(), p.z()};
    };
    const auto path = [&](int i) { return item_path(path_ + ".placed.spheres", i) + ".position"; };
    std::vector<int> order;
    for (int i = 0; i < spheres.size(); ++i) {
      const auto p = place(i);
      if (spheres[i].has_position() && std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2])) order.push_back(i);
    }
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return place(a) < place(b); });
    for (std::size_t k = 1; k < order.size(); ++k) {
      if (place(order[k - 1]) != place(order[k])) continue;
      report(path(order[k]), "is the same point as " + path(order[k - 1]) + ": move one of them");
    }
  }

  const v1::Case& value_;
  const v1::Particles& particles_;
  std::string path_;
  const TypeShares& types_;
  CaseFaults& faults_;
};

void check_settling(const v1::Case& value, const std::string& path, CaseFaults& faults) {
  if (!value.has_gravity()) return;
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

void check_composed(const v1::Case& value, CaseFaults& faults) {
  const v1::Composed& composed = value.particles().composed();
  if (composed.has_settling()) check_settling(value, "particles.composed.settling", faults);
  for (int i = 0; i < composed.regions_size(); ++i) {
    const v1::Region& region = composed.regions(i);
    const std::string path = item_path("particles.composed.regions", i);
    SeedingRules rules(value, path, region.types(), faults);
    if (region.has_random()) rules.check_random(region.random());
    if (region.has_lattice()) rules.check_lattice(region.lattice());
    if (region.has_placed()) rules.check_placed(region.placed());
    if (region.random().has_settling())
      faults.push_back({path + ".random.settling", "is set, but all regions settle together: set particles.composed.settling"});
    if (region.has_placed() && region.types_size() > 0)
      faults.push_back({path + ".types", "is set, but each of the placed spheres names its own type: remove it"});
  }
}

bool has_inflow(const v1::Faces& faces) {
  for (const v1::Face* face : {&faces.x_low(), &faces.x_high(), &faces.y_low(), &faces.y_high(), &faces.z_low(), &faces.z_high()})
    if (face->particle_inflows_size() > 0) return true;
  return false;
}

}  // namespace

void check_seeding(const v1::Case& value, CaseFaults& faults) {
  const v1::Particles& particles = value.particles();
  if (particles.has_composed()) {
    check_composed(value, faults);
  } else {
    const TypeShares all;
    SeedingRules rules(value, "particles", all, faults);
    if (particles.has_random()) rules.check_random(particles.random());
    if (particles.has_lattice()) rules.check_lattice(particles.lattice());
    if (particles.has_placed()) rules.check_placed(particles.placed());
    if (particles.random().has_settling()) check_settling(value, "particles.random.settling", faults);
  }
  if (particles.has_empty() && !has_inflow(value.domain().faces())) {
    faults.push_back({"particles.empty",
                      "leaves the scene without particles, and none enter: set particle_inflows on one of "
                      "domain.faces, or another seeding"});
  }
}

}  // namespace bedflow
