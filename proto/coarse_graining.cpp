#include "coarse_graining.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "case_rules.h"
#include "parameter_text.h"

namespace bedflow {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

std::vector<const FieldDescriptor*> fields_of(const Message& message) {
  std::vector<const FieldDescriptor*> fields;
  message.GetReflection()->ListFields(message, &fields);
  return fields;
}

// All lengths within a message, by their unit.
void scale_lengths(Message& message, double factor) {
  const auto& reflection = *message.GetReflection();
  for (const auto* field : fields_of(message)) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
      if (field->options().GetExtension(v1::parameter).unit() == "m")
        reflection.SetDouble(&message, field, factor * reflection.GetDouble(message, field));
    } else if (field->is_repeated()) {
      for (int i = 0; i < reflection.FieldSize(message, field); ++i)
        scale_lengths(*reflection.MutableRepeatedMessage(&message, field, i), factor);
    } else {
      scale_lengths(*reflection.MutableMessage(&message, field), factor);
    }
  }
}

class Parcels {
 public:
  explicit Parcels(const v1::CoarseGraining& rule)
      : l_(rule.factor()), number_(l_ * l_ * l_), is_restitution_kept_(rule.contacts() == v1::KEEP_RESTITUTION) {}

  void scale(v1::Particles& particles) const {
    scale_sizes(particles);
    scale_contacts(particles);
    for (auto& pair : *particles.mutable_pairs()) scale_pair(particles, pair);
    if (particles.has_van_der_waals()) scale_attraction(*particles.mutable_van_der_waals());
    if (particles.has_random()) scale_count(*particles.mutable_random());
    if (particles.has_lattice()) scale_count(*particles.mutable_lattice());
    if (!particles.has_composed()) return;
    for (auto& region : *particles.mutable_composed()->mutable_regions()) {
      if (region.has_random()) scale_count(*region.mutable_random());
      if (region.has_lattice()) scale_count(*region.mutable_lattice());
    }
  }

  void scale(v1::Faces& faces) const {
    for (const auto* field : fields_of(faces)) {  // all are of type Face
      auto& face = dynamic_cast<v1::Face&>(*faces.GetReflection()->MutableMessage(&faces, field));
      for (auto& inflow : *face.mutable_particle_inflows())
        if (inflow.has_number_rate()) inflow.set_number_rate(inflow.number_rate() / number_);
    }
  }

 private:
  double restitution(double e) const { return is_restitution_kept_ ? e : std::sqrt(1 - l_ * (1 - e * e)); }

  void scale_sizes(v1::Particles& particles) const {
    if (particles.has_diameter()) particles.set_diameter(l_ * particles.diameter());
    for (auto& type : *particles.mutable_types()) scale_lengths(type, l_);
  }

  // What is absent on a wall is as between particles, of which e is about to change.
  template <class Law>
  void scale_restitution(Law& law) const {
    if (!law.has_wall_restitution()) law.set_wall_restitution(law.restitution());
    law.set_restitution(restitution(law.restitution()));
  }

  void scale_contacts(v1::Particles& particles) const {
    if (particles.has_hertz()) scale_restitution(*particles.mutable_hertz());
    if (!particles.has_linear_spring_dashpot()) return;
    auto& law = *particles.mutable_linear_spring_dashpot();
    scale_restitution(law);
    law.set_stiffness(l_ * law.stiffness());
    if (law.has_wall_stiffness()) law.set_wall_stiffness(l_ * law.wall_stiffness());
  }

  void scale_pair(const v1::Particles& particles, v1::PairContact& pair) const {
    if (pair.has_stiffness()) pair.set_stiffness(l_ * pair.stiffness());
    if (pair.has_restitution() && type_named(particles, pair.second())) pair.set_restitution(restitution(pair.restitution()));
    if (pair.has_hamaker()) pair.set_hamaker(number_ * pair.hamaker());
  }

  void scale_attraction(v1::VanDerWaals& law) const {
    law.set_hamaker(number_ * law.hamaker());
    if (law.has_wall_hamaker()) law.set_wall_hamaker(number_ * law.wall_hamaker());
    law.set_nearest(l_ * law.nearest());
    if (law.has_furthest()) law.set_furthest(l_ * law.furthest());
  }

  void scale_count(v1::RandomSeeding& random) const {
    if (random.count() > 0) random.set_count(static_cast<std::uint32_t>(std::max(1.0, std::round(random.count() / number_))));
  }

  void scale_count(v1::Lattice& lattice) const {
    const auto scaled = [&](std::uint32_t count) { return static_cast<std::uint32_t>(std::lround(count / l_)); };
    auto& count = *lattice.mutable_count();
    count.set_x(scaled(count.x()));
    count.set_y(scaled(count.y()));
    count.set_z(scaled(count.z()));
  }

  double l_, number_;  // particles in a parcel
  bool is_restitution_kept_;
};

// ------------------------------------------------------------------------------------------------ rules

const std::string rule_path = "particles.coarse_graining";
const std::string factor_path = rule_path + ".factor";

// e → 0 where a parcel's collisions, l times as rare, take all there is.
void check_restitution(const v1::CoarseGraining& rule, double e, const std::string& path, CaseFaults& faults) {
  const double most = 1 / (1 - e * e);
  if (rule.contacts() == v1::KEEP_RESTITUTION || !(e > 0 && e <= 1) || !(rule.factor() >= most)) return;
  faults.push_back({factor_path, "is " + number_text(rule.factor()) + ": parcels of particles with a restitution of " +
                                     number_text(e) + " (" + path + ") lose as much energy below " +
                                     number_text(std::floor(most * 1e3) / 1e3) + " only; choose a smaller one, or " + rule_path +
                                     ".contacts: KEEP_RESTITUTION"});
}

void check_whole(const v1::Lattice& lattice, double factor, const std::string& path, CaseFaults& faults) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t count = component(lattice.count(), axis);
    const double parcels = count / factor;
    if (std::abs(parcels - std::round(parcels)) <= 1e-9 * parcels) continue;
    faults.push_back({path + ".lattice.count." + axis_names[axis],
                      "is " + std::to_string(count) + ", which parcels " + number_text(factor) + " particles wide do not fill (" +
                          factor_path + "): choose a multiple, or particles.random"});
  }
}

// Of v1::Particles or v1::Region.
template <class Seeding>
void check_places(const Seeding& seeding, double factor, const std::string& path, CaseFaults& faults) {
  if (seeding.has_lattice()) check_whole(seeding.lattice(), factor, path, faults);
  if (!seeding.has_placed()) return;
  faults.push_back({rule_path, "joins particles into parcels, but those of " + path +
                                   ".placed have each their place: remove it, or choose random or lattice"});
}

}  // namespace

void check_coarse_graining(const v1::Case& value, CaseFaults& faults) {
  const v1::Particles& particles = value.particles();
  const v1::CoarseGraining& rule = particles.coarse_graining();
  if (!particles.has_coarse_graining() || !(rule.factor() > 1)) return;
  const bool is_hertz = particles.has_hertz();
  const double e = is_hertz ? particles.hertz().restitution() : particles.linear_spring_dashpot().restitution();
  check_restitution(rule, e, is_hertz ? "particles.hertz" : "particles.linear_spring_dashpot", faults);
  for (int i = 0; i < particles.pairs_size(); ++i)
    if (particles.pairs(i).has_restitution() && type_named(particles, particles.pairs(i).second()))
      check_restitution(rule, particles.pairs(i).restitution(), item_path("particles.pairs", i), faults);
  check_places(particles, rule.factor(), "particles", faults);
  for (int i = 0; i < particles.composed().regions_size(); ++i)
    check_places(particles.composed().regions(i), rule.factor(), item_path("particles.composed.regions", i), faults);
}

v1::Case parcels_of(const v1::Case& value) {
  v1::Case result = value;
  if (!value.particles().has_coarse_graining()) return result;
  const Parcels parcels(value.particles().coarse_graining());
  parcels.scale(*result.mutable_particles());
  if (value.domain().has_faces()) parcels.scale(*result.mutable_domain()->mutable_faces());
  return result;
}

}  // namespace bedflow
