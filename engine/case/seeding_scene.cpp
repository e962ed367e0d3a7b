#include "case/seeding_scene.h"

#include <algorithm>
#include <limits>

#include "case/vector.h"

namespace bedflow {

namespace {

std::vector<SizeClass> classes(const google::protobuf::RepeatedPtrField<v1::SizeClass>& from) {
  std::vector<SizeClass> result;
  for (const v1::SizeClass& size : from) result.push_back({size.diameter(), size.share()});
  return result;
}

SizeLaw size_law(const v1::ParticleType& type) {
  switch (type.sizes_case()) {
    case v1::ParticleType::kUniform:
      return UniformSizes{type.uniform().smallest(), type.uniform().largest()};
    case v1::ParticleType::kNormal:
      return NormalSizes{type.normal().mean(), type.normal().deviation(), type.normal().smallest(), type.normal().largest()};
    case v1::ParticleType::kLogNormal: {
      const v1::LogNormalSizes& law = type.log_normal();
      return LogNormalSizes{law.median(), law.deviation(), law.smallest(), law.largest()};
    }
    case v1::ParticleType::kDiscrete:
      return DiscreteSizes{classes(type.discrete().classes())};
    case v1::ParticleType::kHistogram:
      return HistogramSizes{type.histogram().smallest(), classes(type.histogram().classes())};
    default:
      return ConstantSize{type.constant().diameter()};
  }
}

Basis basis(v1::Basis from) {
  return from == v1::MASS ? Basis::mass : Basis::number;
}

// One region, told by a message that has random, placed or lattice.
class Regions {
 public:
  Regions(const v1::Case& from, const std::vector<SeedKind>& kinds) : from_(from), kinds_(kinds) {}

  template <class Message>
  SeedRegion region(const std::string& path, const Message& message, const TypeShares& named) const {
    const std::vector<double> shares = kind_shares(from_.particles(), kinds_, named);
    if (message.has_placed()) return {path, placed(message.placed())};
    if (message.has_lattice()) return {path, lattice(message.lattice(), shares)};
    return {path, random(message.random(), shares)};
  }

 private:
  Vec3 low(bool given, const v1::Box& box) const { return given ? vec(box.low()) : Vec3{}; }
  Vec3 high(bool given, const v1::Box& box) const {
    const v1::Lengths& size = from_.domain().size();
    return given ? vec(box.high()) : Vec3{size.x(), size.y(), size.z()};
  }

  RandomSeeds random(const v1::RandomSeeding& random, const std::vector<double>& shares) const {
    return {.count = random.count(),
            .seed = random.seed(),
            .low = low(random.has_region(), random.region()),
            .high = high(random.has_region(), random.region()),
            .velocity_deviation = random.velocity_deviation(),
            .solids_fraction = random.solids_fraction(),
            .shares = shares};
  }
  LatticeSeeds lattice(const v1::Lattice& lattice, const std::vector<double>& shares) const {
    const v1::Cells& n = lattice.count();
    return {.count = {static_cast<int>(n.x()), static_cast<int>(n.y()), static_cast<int>(n.z())},
            .low = low(lattice.has_region(), lattice.region()),
            .high = high(lattice.has_region(), lattice.region()),
            .seed = lattice.seed(),
            .shares = shares};
  }
  PlacedSeeds placed(const v1::Placed& placed) const {
    PlacedSeeds spheres;
    for (const v1::Sphere& sphere : placed.spheres())
      spheres.push_back({vec(sphere.position()), vec(sphere.velocity()), vec(sphere.spin()),
                         std::max(0, type_index(from_.particles(), sphere.type())), sphere.diameter()});
    return spheres;
  }

  const v1::Case& from_;
  const std::vector<SeedKind>& kinds_;
};

}  // namespace

int type_index(const v1::Particles& particles, const std::string& name) {
  const auto& types = particles.types();
  const auto found = std::ranges::find(types, name, [](const v1::ParticleType& type) { return type.name(); });
  return found == types.end() ? -1 : static_cast<int>(found - types.begin());
}

std::vector<SeedKind> seed_kinds(const v1::Particles& particles) {
  if (particles.types_size() == 0)
    return {{"particles", SizeDistribution(ConstantSize{particles.diameter()}), particles.density()}};
  std::vector<SeedKind> kinds;
  for (const v1::ParticleType& type : particles.types())
    kinds.push_back({type.name(), SizeDistribution(size_law(type), basis(type.sizes_by())), type.density()});
  return kinds;
}

std::vector<double> kind_shares(const v1::Particles& particles, const std::vector<SeedKind>& kinds, const TypeShares& named) {
  std::vector<double> shares(kinds.size(), named.empty() && particles.types_size() == 0 ? 1 : 0);
  if (named.empty())
    for (int k = 0; k < particles.types_size(); ++k) shares[k] = particles.types(k).share();
  for (const v1::TypeShare& share : named) shares[type_index(particles, share.type())] = share.share();
  return number_shares(kinds, shares, basis(particles.shares_by()));
}

std::vector<SeedRegion> seed_regions(const v1::Case& from, const std::vector<SeedKind>& kinds) {
  const Regions regions(from, kinds);
  const v1::Particles& particles = from.particles();
  std::vector<SeedRegion> result;
  for (int i = 0; i < particles.composed().regions_size(); ++i) {
    const v1::Region& region = particles.composed().regions(i);
    result.push_back(regions.region("particles.composed.regions[" + std::to_string(i) + "]", region, region.types()));
  }
  if (!particles.has_composed() && !particles.has_empty()) result.push_back(regions.region("particles", particles, {}));
  return result;
}

std::vector<Inlet> particle_inlets(const v1::Case& from, const std::vector<SeedKind>& kinds) {
  const v1::Faces& f = from.domain().faces();
  const v1::Face* const faces[] = {&f.x_low(), &f.x_high(), &f.y_low(), &f.y_high(), &f.z_low(), &f.z_high()};
  const v1::Lengths& size = from.domain().size();
  std::vector<Inlet> inlets;
  for (int face = 0; face < 6; ++face)
    for (const v1::ParticleInflow& inflow : faces[face]->particle_inflows())
      inlets.push_back({.direction = face / 2,
                        .side = face % 2,
                        .low = inflow.has_patch() ? vec(inflow.patch().low()) : Vec3{},
                        .high = inflow.has_patch() ? vec(inflow.patch().high()) : Vec3{size.x(), size.y(), size.z()},
                        .rate = inflow.has_mass_rate() ? inflow.mass_rate() : inflow.number_rate(),
                        .basis = inflow.has_mass_rate() ? Basis::mass : Basis::number,
                        .velocity = vec(inflow.velocity()),
                        .shares = kind_shares(from.particles(), kinds, inflow.types()),
                        .from = inflow.from(),
                        .until = inflow.has_until() ? inflow.until() : std::numeric_limits<double>::infinity(),
                        .seed = inflow.seed()});
  return inlets;
}

const v1::Settling* settling_of(const v1::Particles& particles) {
  if (particles.composed().has_settling()) return &particles.composed().settling();
  return particles.random().has_settling() ? &particles.random().settling() : nullptr;
}

}  // namespace bedflow
