#include "beds.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

#include "support/seeds.h"

namespace bedflow {

namespace {

constexpr std::int64_t count = 24750;
constexpr Vec3 box{0.15, 0.45, 0.015};  // m

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

File open(const std::filesystem::path& path, const char* mode) {
  File file(std::fopen(path.c_str(), mode), std::fclose);
  if (!file) throw std::runtime_error(path.string() + " cannot be opened");
  return file;
}

std::size_t kinds_of(const Bed& bed) {
  int last = 0;
  for (const PlacedSphere& sphere : bed.spheres) last = std::max(last, sphere.kind);
  return static_cast<std::size_t>(last) + 1;
}

// Takes its name when it is whole.
void write(const std::filesystem::path& path, const Bed& bed) {
  const std::filesystem::path partial = path.string() + "." + std::to_string(getpid());
  {
    const File file = open(partial, "w");
    std::fprintf(file.get(), "a settled bed\n\n%zu atoms\n%zu atom types\n", bed.spheres.size(), kinds_of(bed));
    for (int d = 0; d < 3; ++d) std::fprintf(file.get(), "0 %.17g %clo %chi\n", bed.box[d], "xyz"[d], "xyz"[d]);
    std::fprintf(file.get(), "\nAtoms # sphere\n\n");
    for (std::size_t i = 0; i < bed.spheres.size(); ++i) {
      const auto& [x, v, w, kind, diameter] = bed.spheres[i];
      std::fprintf(file.get(), "%zu %d %.17g %.17g %.17g %.17g %.17g\n", i + 1, kind + 1, diameter, bed_spheres().density, x.x,
                   x.y, x.z);
    }
    std::fprintf(file.get(), "\nVelocities\n\n");
    for (std::size_t i = 0; i < bed.spheres.size(); ++i) {
      const Vec3 v = bed.spheres[i].velocity, w = bed.spheres[i].spin;
      std::fprintf(file.get(), "%zu %.17g %.17g %.17g %.17g %.17g %.17g\n", i + 1, v.x, v.y, v.z, w.x, w.y, w.z);
    }
  }
  std::filesystem::rename(partial, path);
}

Bed read(const std::filesystem::path& path) {
  const File file = open(path, "r");
  const auto expect = [&](int got, int wanted) {
    if (got != wanted) throw std::runtime_error(path.string() + " is not a settled bed: delete it, and it is made anew");
  };
  Bed bed;
  std::size_t size = 0;
  expect(std::fscanf(file.get(), "a settled bed %zu atoms %*d atom types", &size), 1);
  expect(std::fscanf(file.get(), " 0 %lf xlo xhi 0 %lf ylo yhi 0 %lf zlo zhi", &bed.box.x, &bed.box.y, &bed.box.z), 3);
  bed.spheres.resize(size);
  expect(std::fscanf(file.get(), " Atoms # sphere"), 0);
  for (PlacedSphere& sphere : bed.spheres) {
    Vec3& x = sphere.position;
    expect(std::fscanf(file.get(), "%*d %d %lf %*f %lf %lf %lf", &sphere.kind, &sphere.diameter, &x.x, &x.y, &x.z), 5);
    --sphere.kind;
  }
  expect(std::fscanf(file.get(), " Velocities"), 0);
  for (PlacedSphere& sphere : bed.spheres) {
    Vec3 &v = sphere.velocity, &w = sphere.spin;
    expect(std::fscanf(file.get(), "%*d %lf %lf %lf %lf %lf %lf", &v.x, &v.y, &v.z, &w.x, &w.y, &w.z), 6);
  }
  return bed;
}

// With friction that holds a bed at rest.
Bed rested(const Bed& bed, double restitution, double time, double dt) {
  BedScene scene(bed, bed_laws("spring", kinds_of(bed), restitution), false);
  scene.dem.advance(static_cast<int>(time / dt), dt);
  return scene.bed();
}

// Falls from random places with little rebound, then comes to rest with its own. Small spheres between large ones are thrown up
// and need longer.
Bed fallen(int kinds) {
  const double diameter = bed_spheres().diameter;
  const Decomposition whole(Comm::self(), {1, 1, 1}, box, {false, false, false});
  const ParticleStore seeds = seed_random(whole, diameter / 2, {count, 1, {0, 0, 0}, {box.x, 0.33, box.z}, 0});
  Bed bed{box, {}};
  for (std::size_t i = 0; i < seeds.owned; ++i) {
    const int kind = static_cast<int>(i) % kinds;
    bed.spheres.push_back({seeds.position(i), {}, {}, kind, diameter / (kind + 1)});
  }
  const Bed down = kinds == 1 ? rested(bed, 0.5, 0.3, bed_substep) : rested(bed, 0.2, 0.6, bed_substep);
  return rested(down, bed_spheres().restitution, 0.05, bed_substep / kinds);
}

// Side by side. What leant on the walls that are no more opens the contacts all through the bed; it settles again, in long
// sub-steps (τ/8) since only the rest counts.
Bed repeated(const Bed& one, int along_x, int along_z) {
  Bed bed{{along_x * box.x, box.y, along_z * box.z}, {}};
  for (int i = 0; i < along_x; ++i)
    for (int k = 0; k < along_z; ++k)
      for (PlacedSphere sphere : one.spheres) {
        sphere.position += {i * box.x, 0, k * box.z};
        bed.spheres.push_back(sphere);
      }
  return rested(bed, 0.3, 0.08, 2.5 * bed_substep);
}

}  // namespace

double Bed::height() const {
  double highest = 0;
  for (const PlacedSphere& sphere : spheres) highest = std::max(highest, sphere.position.y + sphere.diameter / 2);
  return highest;
}

std::filesystem::path settled_bed_path(int along_x, int along_z) {
  const std::string name = "bedflow_bench_bed_" + std::to_string(along_x) + "_" + std::to_string(along_z) + ".data";
  return std::filesystem::temp_directory_path() / name;
}

Bed settled_bed(int along_x, int along_z) {
  const std::filesystem::path path = settled_bed_path(along_x, along_z);
  if (!std::filesystem::exists(path)) write(path, along_x * along_z == 1 ? fallen(1) : repeated(settled_bed(), along_x, along_z));
  return read(path);
}

Bed settled_bed_of_two_sizes() {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "bedflow_bench_bed_two_sizes.data";
  if (!std::filesystem::exists(path)) write(path, fallen(2));
  return read(path);
}

ContactLaws bed_laws(const std::string& name, std::size_t kinds, double restitution) {
  const auto everywhere = [&]<class Law>(const Law& law) {
    return LawTable<Law>{std::vector(kinds * (kinds + 1) / 2, law), std::vector(kinds, law)};
  };
  const Spheres spheres = bed_spheres();
  const auto linear = LinearSpringDashpot::from_restitution(spheres.stiffness, restitution);
  constexpr double modulus = 2.5e7, poisson = 0.3, young = 2 * (1 - poisson * poisson) * modulus;  // Pa
  const auto hertz = Hertz::from_restitution(modulus, restitution);
  ContactLaws laws;
  laws.contact = everywhere(linear);
  if (name == "frictionless") laws.tangential = everywhere(Frictionless{});
  if (name == "coulomb") laws.tangential = everywhere(Coulomb{spheres.friction});
  if (name == "spring") laws.tangential = everywhere(TangentialSpring::from_normal(spheres.friction, linear));
  if (name == "hertz_mindlin") {
    laws.contact = everywhere(hertz);
    const double shear = young / (2 * (1 + poisson)) / (2 * (2 - poisson));  // G*
    laws.tangential = everywhere(Mindlin{spheres.friction, shear, hertz.damping_share});
  }
  return laws;
}

namespace {

DemSetup setup_of(const Bed& bed, bool gas) {
  const Spheres spheres = bed_spheres();
  DemSetup setup;
  for (std::size_t kind = 0; kind < kinds_of(bed); ++kind)
    setup.types.push_back({spheres.diameter / 2 / static_cast<double>(kind + 1), spheres.density, false});
  setup.gravity = spheres.gravity;
  setup.skin = spheres.skin;
  setup.gas = gas ? GasForce::frozen : GasForce::none;
  return setup;
}

}  // namespace

BedScene::BedScene(const Bed& bed, const ContactLaws& laws, bool gas)
    : decomposition_(Comm::self(), {1, 1, 1}, bed.box, {false, false, false}),
      dem(decomposition_, setup_of(bed, gas), laws, timer_) {
  ParticleStore store;
  for (std::size_t i = 0; i < bed.spheres.size(); ++i) {
    const PlacedSphere& sphere = bed.spheres[i];
    store.add(static_cast<std::int64_t>(i), sphere.position, sphere.velocity, sphere.spin);
    if (dem.setup().types.size() > 1) store.type.push_back(static_cast<std::uint8_t>(sphere.kind));
  }
  dem.set_particles(std::move(store));
}

Bed BedScene::bed() const {
  if (dem.failure()) throw std::runtime_error(dem.failure().message);
  const ParticleStore& particles = dem.particles();
  Bed bed{decomposition_.size(), std::vector<PlacedSphere>(particles.owned)};
  for (std::size_t i = 0; i < particles.owned; ++i) {
    const int kind = particles.type.empty() ? 0 : particles.type[i];
    bed.spheres[static_cast<std::size_t>(particles.id[i])] = {particles.position(i), particles.velocity(i), particles.spin(i),
                                                              kind, 2 * radius_of(dem.setup().types, particles, i)};
  }
  return bed;
}

}  // namespace bedflow
