#include "beds.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

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

// Takes its name when it is whole.
void write(const std::filesystem::path& path, const Bed& bed) {
  const std::filesystem::path partial = path.string() + "." + std::to_string(getpid());
  {
    const File file = open(partial, "w");
    std::fprintf(file.get(), "a settled bed\n\n%zu atoms\n1 atom types\n", bed.spheres.size());
    for (int d = 0; d < 3; ++d) std::fprintf(file.get(), "0 %.17g %clo %chi\n", bed.box[d], "xyz"[d], "xyz"[d]);
    std::fprintf(file.get(), "\nAtoms # sphere\n\n");
    const Spheres kind = bed_spheres();
    for (std::size_t i = 0; i < bed.spheres.size(); ++i) {
      const Vec3 x = bed.spheres[i].position;
      std::fprintf(file.get(), "%zu 1 %.17g %.17g %.17g %.17g %.17g\n", i + 1, kind.diameter, kind.density, x.x, x.y, x.z);
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
  expect(std::fscanf(file.get(), "a settled bed %zu atoms 1 atom types", &size), 1);
  expect(std::fscanf(file.get(), " 0 %lf xlo xhi 0 %lf ylo yhi 0 %lf zlo zhi", &bed.box.x, &bed.box.y, &bed.box.z), 3);
  bed.spheres.resize(size);
  expect(std::fscanf(file.get(), " Atoms # sphere"), 0);
  for (PlacedSphere& sphere : bed.spheres) {
    Vec3& x = sphere.position;
    expect(std::fscanf(file.get(), "%*d 1 %*f %*f %lf %lf %lf", &x.x, &x.y, &x.z), 3);
  }
  expect(std::fscanf(file.get(), " Velocities"), 0);
  for (PlacedSphere& sphere : bed.spheres) {
    Vec3 &v = sphere.velocity, &w = sphere.spin;
    expect(std::fscanf(file.get(), "%*d %lf %lf %lf %lf %lf %lf", &v.x, &v.y, &v.z, &w.x, &w.y, &w.z), 6);
  }
  return bed;
}

using Sticking = Scene<TangentialSpring>;  // friction that holds a bed at rest

Bed bed_of(const Sticking& scene) {
  if (scene.dem.failure()) throw std::runtime_error(scene.dem.failure().message);
  Bed bed{scene.decomposition().size(), {}};
  for (const auto& [id, particle] : scene.gathered())
    bed.spheres.push_back({particle.position, particle.velocity, particle.spin});
  return bed;
}

Bed rested(const Bed& bed, double restitution, double time, double dt) {
  Spheres spheres = bed_spheres();
  spheres.restitution = restitution;
  Sticking scene(Comm::self(), bed.box, spheres);
  scene.place(bed.spheres);
  scene.advance(static_cast<int>(time / dt), dt);
  return bed_of(scene);
}

// Falls from random places with little rebound (0.3 s), then comes to rest with its own (0.05 s).
Bed fallen() {
  Spheres dull = bed_spheres();
  dull.restitution = 0.5;
  Sticking falling(Comm::self(), box, dull);
  falling.seed({count, 1, {0, 0, 0}, {box.x, 0.33, box.z}, 0});
  falling.advance(30000, bed_substep);
  return rested(bed_of(falling), bed_spheres().restitution, 0.05, bed_substep);
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
  for (const PlacedSphere& sphere : spheres) highest = std::max(highest, sphere.position.y);
  return highest + bed_spheres().diameter / 2;
}

std::filesystem::path settled_bed_path(int along_x, int along_z) {
  const std::string name = "bedflow_bench_bed_" + std::to_string(along_x) + "_" + std::to_string(along_z) + ".data";
  return std::filesystem::temp_directory_path() / name;
}

Bed settled_bed(int along_x, int along_z) {
  const std::filesystem::path path = settled_bed_path(along_x, along_z);
  if (!std::filesystem::exists(path)) write(path, along_x * along_z == 1 ? fallen() : repeated(settled_bed(), along_x, along_z));
  return read(path);
}

}  // namespace bedflow
