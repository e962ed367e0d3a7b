#include "particles/seeding.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "base/stop.h"
#include "particles/occupied.h"
#include "particles/random.h"

namespace bedflow {

namespace {

constexpr int most_tries = 20000;  // for one sphere
constexpr double closest_regions =
    0.9;                             // spheres of two regions, in the sum of their radii: slight overlaps are preloaded contacts
constexpr double round_off = 1e-12;  // of a division: spheres that just touch are allowed

double box_volume(Vec3 low, Vec3 high) {
  const Vec3 edges = high - low;
  return edges.x * edges.y * edges.z;
}

std::vector<double> shares_of(const std::vector<SeedKind>& kinds, const std::vector<double>& shares) {
  return shares.empty() ? std::vector<double>(kinds.size(), 1.0 / static_cast<double>(kinds.size())) : shares;
}

// Volume of the solids of each kind, m³.
std::vector<double> volumes_wanted(const std::vector<SeedKind>& kinds, const RandomSeeds& seeds) {
  std::vector<double> volumes = shares_of(kinds, seeds.shares);
  for (std::size_t k = 0; k < kinds.size(); ++k) volumes[k] *= kinds[k].mean_volume();
  const double all = std::accumulate(volumes.begin(), volumes.end(), 0.0);
  for (double& v : volumes) v *= seeds.solids_fraction * box_volume(seeds.low, seeds.high) / all;
  return volumes;
}

// ---------------------------------------------------------------------------------------------------- kinds and diameters

double draw(const SizeDistribution& sizes, Random& random) {
  return sizes.constant() ? sizes.largest() : sizes.quantile(random.uniform());
}

// Whole numbers of each kind that add up to the count, by the largest remainders.
std::vector<std::int64_t> quotas(const std::vector<double>& shares, std::int64_t count) {
  std::vector<std::int64_t> result(shares.size());
  std::vector<std::pair<double, std::size_t>> remainders;
  std::int64_t left = count;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    const double exact = shares[k] * static_cast<double>(count);
    result[k] = static_cast<std::int64_t>(std::floor(exact));
    left -= result[k];
    remainders.emplace_back(static_cast<double>(result[k]) - exact, k);
  }
  std::ranges::sort(remainders);
  for (std::size_t r = 0; left > 0; r = (r + 1) % remainders.size(), --left) ++result[remainders[r].second];
  return result;
}

using Spheres = std::vector<PlacedSphere>;  // of kinds and diameters that are drawn, without a place

Spheres draw_count(const std::vector<SeedKind>& kinds, const std::vector<double>& shares, std::int64_t count, Random& random) {
  Spheres spheres;
  const std::vector<std::int64_t> of_kind = quotas(shares_of(kinds, shares), count);
  for (std::size_t k = 0; k < kinds.size(); ++k)
    for (std::int64_t n = 0; n < of_kind[k]; ++n)
      spheres.push_back({.kind = static_cast<int>(k), .diameter = draw(kinds[k].sizes, random)});
  return spheres;
}

Spheres draw_volume(const std::vector<SeedKind>& kinds, const RandomSeeds& seeds, Random& random) {
  Spheres spheres;
  const std::vector<double> wanted = volumes_wanted(kinds, seeds);
  for (std::size_t k = 0; k < kinds.size(); ++k)
    for (double filled = 0;;) {
      const double diameter = draw(kinds[k].sizes, random);
      if (filled + sphere_volume(diameter) / 2 > wanted[k]) break;
      filled += sphere_volume(diameter);
      spheres.push_back({.kind = static_cast<int>(k), .diameter = diameter});
    }
  return spheres;
}

// ---------------------------------------------------------------------------------------------------- random regions

[[noreturn]] void refuse_region(const std::string& path, const RandomSeeds& seeds, const Spheres& spheres, std::size_t placed) {
  const Vec3 edges = seeds.high - seeds.low;
  double solid = 0;
  for (const PlacedSphere& sphere : spheres) solid += sphere_volume(sphere.diameter);
  std::ostringstream message;
  message << path << ".random.region: " << spheres.size() << " spheres of ";
  if (spheres.back().diameter < spheres.front().diameter) message << spheres.back().diameter << " to ";
  message << spheres.front().diameter << " m do not fit at random into " << edges.x << " x " << edges.y << " x " << edges.z
          << " m; they are " << solid / box_volume(seeds.low, seeds.high)
          << " of it, and random places without overlap are found to about 0.3 (" << placed
          << " found a place); enlarge the region, or lower " << path << ".random."
          << (seeds.solids_fraction > 0 ? "solids_fraction" : "count");
  throw Stop(Reason::invalid_case, message.str());
}

Spheres random_spheres(const std::vector<SeedKind>& kinds, const std::string& path, const RandomSeeds& seeds,
                       Occupied& occupied) {
  Random random(seeds.seed);
  Spheres spheres =
      seeds.solids_fraction > 0 ? draw_volume(kinds, seeds, random) : draw_count(kinds, seeds.shares, seeds.count, random);
  std::ranges::stable_sort(spheres, std::ranges::greater{}, &PlacedSphere::diameter);
  for (std::size_t n = 0; n < spheres.size(); ++n) {
    const double radius = spheres[n].diameter / 2;
    const Vec3 margin{radius, radius, radius}, low = seeds.low + margin, high = seeds.high - margin;
    Occupied::Sphere sphere{{}, radius};
    int tries = 0;
    do {
      if (tries++ == most_tries || low.x > high.x || low.y > high.y || low.z > high.z) refuse_region(path, seeds, spheres, n);
      sphere.centre = random.inside(low, high);
    } while (!occupied.is_free(sphere));
    occupied.add(sphere);
    spheres[n].position = sphere.centre;
  }
  for (PlacedSphere& sphere : spheres)
    if (seeds.velocity_deviation > 0)
      for (int d = 0; d < 3; ++d) sphere.velocity[d] = seeds.velocity_deviation * random.gaussian();
  return spheres;
}

// ---------------------------------------------------------------------------------------------------- told regions

Spheres lattice_spheres(const std::vector<SeedKind>& kinds, const std::string& path, const LatticeSeeds& seeds) {
  Random random(seeds.seed);
  const Int3 count = seeds.count;
  Spheres spheres = draw_count(kinds, seeds.shares, static_cast<std::int64_t>(count[0]) * count[1] * count[2], random);
  double largest = 0;
  for (const PlacedSphere& sphere : spheres) largest = std::max(largest, sphere.diameter);
  Vec3 spacing;
  for (int d = 0; d < 3; ++d) {
    spacing[d] = (seeds.high[d] - seeds.low[d]) / count[d];
    if (count[d] > 0 && spacing[d] < largest * (1 - round_off)) {
      std::ostringstream message;
      message << path << ".lattice.count."
              << "xyz"[d] << ": " << count[d] << " particles in " << seeds.high[d] - seeds.low[d] << " m stand " << spacing[d]
              << " m apart, less than the largest diameter " << largest << " m; enlarge " << path
              << ".lattice.region or lower the count";
      throw Stop(Reason::invalid_case, message.str());
    }
  }
  const bool alike = std::ranges::all_of(
      spheres, [&](const PlacedSphere& s) { return s.kind == spheres.front().kind && s.diameter == spheres.front().diameter; });
  for (std::size_t n = spheres.size(); n > 1 && !alike; --n)  // Fisher & Yates
    std::swap(spheres[n - 1], spheres[static_cast<std::size_t>(random.uniform() * static_cast<double>(n))]);
  std::size_t n = 0;
  for (int k = 0; k < count[2]; ++k)
    for (int j = 0; j < count[1]; ++j)
      for (int i = 0; i < count[0]; ++i)
        spheres[n++].position = seeds.low + Vec3{(i + 0.5) * spacing.x, (j + 0.5) * spacing.y, (k + 0.5) * spacing.z};
  return spheres;
}

Spheres placed_spheres(const std::vector<SeedKind>& kinds, const PlacedSeeds& seeds) {
  Random random(0);
  Spheres spheres = seeds;
  for (PlacedSphere& sphere : spheres)
    if (sphere.diameter == 0) sphere.diameter = draw(kinds[sphere.kind].sizes, random);
  return spheres;
}

void add_told(const std::string& path, const Spheres& spheres, Occupied& occupied) {
  for (const PlacedSphere& sphere : spheres) {
    const Occupied::Sphere here{sphere.position, sphere.diameter / 2};
    const Occupied::Sphere* other = occupied.find_overlap(here, closest_regions);
    if (!other) continue;
    std::ostringstream message;
    message << path << ": its particle at (" << here.centre.x << ", " << here.centre.y << ", " << here.centre.z
            << ") m overlaps that of another region at (" << other->centre.x << ", " << other->centre.y << ", " << other->centre.z
            << ") m by more than a tenth of their sizes; move one of the regions";
    throw Stop(Reason::invalid_case, message.str());
  }
  for (const PlacedSphere& sphere : spheres) occupied.add({sphere.position, sphere.diameter / 2});
}

Occupied empty_room(const std::vector<SeedKind>& kinds, const std::vector<SeedRegion>& regions) {
  double largest = 0;
  for (const SeedKind& kind : kinds) largest = std::max(largest, kind.sizes.largest());
  std::int64_t count = 0;
  for (const SeedRegion& region : regions) count += expected_count(kinds, region);
  const auto [low, high] = seed_extent(regions);
  return {low, high, largest, count};
}

}  // namespace

std::vector<double> number_shares(const std::vector<SeedKind>& kinds, std::vector<double> shares, Basis basis) {
  if (basis == Basis::mass)
    for (std::size_t k = 0; k < kinds.size(); ++k) shares[k] /= kinds[k].density * kinds[k].mean_volume();
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  for (double& share : shares) share /= sum;
  return shares;
}

std::int64_t expected_count(const std::vector<SeedKind>& kinds, const SeedRegion& region) {
  if (const auto* placed = std::get_if<PlacedSeeds>(&region.seeds)) return static_cast<std::int64_t>(placed->size());
  if (const auto* lattice = std::get_if<LatticeSeeds>(&region.seeds))
    return static_cast<std::int64_t>(lattice->count[0]) * lattice->count[1] * lattice->count[2];
  const auto& seeds = std::get<RandomSeeds>(region.seeds);
  if (!(seeds.solids_fraction > 0)) return seeds.count;
  const std::vector<double> volumes = volumes_wanted(kinds, seeds);
  std::int64_t count = 0;
  for (std::size_t k = 0; k < kinds.size(); ++k) count += std::llround(volumes[k] / kinds[k].mean_volume());
  return count;
}

SeedExtent seed_extent(const std::vector<SeedRegion>& regions) {
  constexpr double far = std::numeric_limits<double>::max();
  SeedExtent box{{far, far, far}, {-far, -far, -far}};
  const auto include = [&](Vec3 x) {
    for (int d = 0; d < 3; ++d) box.low[d] = std::min(box.low[d], x[d]), box.high[d] = std::max(box.high[d], x[d]);
  };
  for (const SeedRegion& region : regions) {
    std::visit(
        [&]<class Seeds>(const Seeds& seeds) {
          if constexpr (std::is_same_v<Seeds, PlacedSeeds>) {
            for (const PlacedSphere& sphere : seeds) include(sphere.position);
          } else {
            include(seeds.low), include(seeds.high);
          }
        },
        region.seeds);
  }
  return box.low.x <= box.high.x ? box : SeedExtent{};
}

std::vector<PlacedSphere> seed_spheres(const std::vector<SeedKind>& kinds, const std::vector<SeedRegion>& regions) {
  Spheres all;
  Occupied occupied = empty_room(kinds, regions);
  const auto append = [&](const Spheres& spheres) { all.insert(all.end(), spheres.begin(), spheres.end()); };
  for (const SeedRegion& region : regions) {
    if (std::holds_alternative<RandomSeeds>(region.seeds)) continue;
    const auto* placed = std::get_if<PlacedSeeds>(&region.seeds);
    const Spheres spheres =
        placed ? placed_spheres(kinds, *placed) : lattice_spheres(kinds, region.path, std::get<LatticeSeeds>(region.seeds));
    if (regions.size() > 1) add_told(region.path, spheres, occupied);
    append(spheres);
  }
  for (const SeedRegion& region : regions)
    if (const auto* seeds = std::get_if<RandomSeeds>(&region.seeds)) append(random_spheres(kinds, region.path, *seeds, occupied));
  return all;
}

ParticleStore keep_owned(const Decomposition& decomposition, const DemSetup& setup, const std::vector<PlacedSphere>& spheres) {
  ParticleStore store;
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const PlacedSphere& s = spheres[i];
    if (decomposition.owner(s.position) == decomposition.comm().rank())
      store.add(setup, static_cast<std::int64_t>(i), s.position, s.velocity, s.spin, s.kind, s.diameter / 2);
  }
  return store;
}

}  // namespace bedflow
