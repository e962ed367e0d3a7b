// What the particles of a bed cost on so many ranks, and what the ranks say to each other: the measurements of scaling.py, as
// JSON.
//
// usage: bench_scaling bed LAW BEDS_ALONG_X BEDS_ALONG_Z SUBSTEPS   the ranks share one bed
//        bench_scaling alone LAW BEDS_ALONG_X BEDS_ALONG_Z SUBSTEPS each rank has such a bed to itself
//        bench_scaling messages                                     seconds of an exchange and of a reduction
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "beds.h"
#include "particles/cells.h"
#include "support/dem_scene.h"

namespace bedflow {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Contacts of this rank's particles with ghosts.
std::int64_t contacts_across(const ParticleStore& particles, double diameter) {
  std::vector<Vec3> places = particles.positions();
  Cells cells;
  cells.sort(places, diameter);
  std::int64_t count = 0;
  for (std::size_t ghost = particles.owned; ghost < particles.rows.size(); ++ghost)
    cells.around(particles.position(ghost), diameter, [&](std::uint32_t first, std::uint32_t last) {
      for (std::uint32_t n = first; n < last; ++n) count += norm(places[cells.order()[n]] - particles.position(ghost)) < diameter;
    });
  return count;
}

// The numbers of a rank, by name; `all` are those of every rank.
class Numbers {
 public:
  void add(const std::string& name, double value) { names_.push_back(name), values_.push_back(value); }
  json all(const Comm& comm) const {
    const std::vector<double> gathered = comm.gather_all(values_);
    json result;
    for (std::size_t i = 0; i < gathered.size(); ++i) result[names_[i % names_.size()]].push_back(gathered[i]);
    return result;
  }

 private:
  std::vector<std::string> names_;
  std::vector<double> values_;
};

template <class Law>
json measured(const Comm& world, bool alone, int along_x, int along_z, int substeps) {
  constexpr int blocks = 3;
  const Bed bed = settled_bed(along_x, along_z);
  const Comm comm = alone ? Comm::self() : world;
  const auto cells = [](double edge) { return static_cast<int>(edge / 5e-3); };
  Scene<Law> scene(comm, bed.box, bed_spheres(), {cells(bed.box.x), cells(bed.box.y), cells(bed.box.z)}, false, 1);
  scene.place(bed.spheres);
  scene.advance(200, bed_substep);
  const ParticleStore& particles = scene.dem.particles();
  const std::set<std::int64_t> first(particles.id.begin(), particles.id.begin() + static_cast<std::ptrdiff_t>(particles.owned));

  const std::int64_t rebuilds = scene.dem.rebuilds();
  Traffic traffic;
  std::vector<double> phases(phase_count), times;
  for (int p = 0; p < phase_count; ++p) phases[p] = -scene.timer[static_cast<Phase>(p)].seconds;
  for (int block = 0; block < blocks; ++block) {
    world.barrier();
    const Traffic before = comm.traffic();
    const auto start = Clock::now();
    scene.advance(substeps, bed_substep);
    traffic += comm.traffic() - before;
    times.push_back(world.max(seconds_since(start)) / substeps);
  }
  for (int p = 0; p < phase_count; ++p) phases[p] += scene.timer[static_cast<Phase>(p)].seconds;

  std::int64_t arrived = 0;
  for (std::size_t i = 0; i < particles.owned; ++i) arrived += !first.contains(particles.id[i]);
  const double all_substeps = blocks * substeps;
  Numbers mine;
  mine.add("owned", static_cast<double>(particles.owned));
  mine.add("ghosts", static_cast<double>(particles.rows.size() - particles.owned));
  mine.add("touching", static_cast<double>(scene.dem.contact_count()));
  mine.add("across", static_cast<double>(contacts_across(particles, bed_spheres().diameter)));
  mine.add("arrived", static_cast<double>(arrived));
  mine.add("messages", static_cast<double>(traffic.messages) / all_substeps);
  mine.add("bytes", static_cast<double>(traffic.bytes) / all_substeps);
  mine.add("collectives", static_cast<double>(traffic.collectives) / all_substeps);
  mine.add("communication", traffic.seconds / all_substeps);
  for (const Phase phase : {Phase::pairs, Phase::contacts, Phase::walls, Phase::integration, Phase::migration})
    mine.add(std::string(phase_names[static_cast<int>(phase)]), phases[static_cast<int>(phase)] / all_substeps);
  json result = {{"ranks", mine.all(world)},
                 {"seconds_per_substep", times},
                 {"substeps", all_substeps},
                 {"rebuilds", scene.dem.rebuilds() - rebuilds},
                 {"box", {bed.box.x, bed.box.y, bed.box.z}}};
  if (world.any(static_cast<bool>(scene.dem.failure()))) result["failure"] = scene.dem.failure().message;
  return result;
}

// Seconds of one call, the best of several passes.
template <class Call>
double best_time(const Comm& comm, int repeats, Call call) {
  double best = 1e9;
  for (int pass = 0; pass < 10; ++pass) {
    comm.barrier();
    const auto start = Clock::now();
    for (int repeat = 0; repeat < repeats; ++repeat) call();
    best = std::min(best, comm.max(seconds_since(start)) / repeats);
  }
  return best;
}

json messages(const Comm& comm) {
  const int other = comm.size() - 1 - comm.rank();
  json result;
  for (const std::size_t length : {1, 64, 1024, 8192, 65536}) {
    const std::vector<double> values(length, 1.0);
    const std::array send = {values, values};
    std::array receive = send;
    const std::array<int, 2> neighbours = comm.rank() < other ? std::array{-1, other} : std::array{other, -1};
    const double seconds = best_time(comm, 2000, [&] { comm.exchange(neighbours, send, receive); });
    result["exchange"].push_back({{"bytes", 8 * length}, {"seconds", seconds}});
  }
  result["reduction"] = best_time(comm, 2000, [&] { comm.max(std::int64_t{1}); });
  return result;
}

json answer(const Comm& comm, const std::vector<std::string>& words) {
  if (words.size() == 1 && words[0] == "messages") return messages(comm);
  if (words.size() != 5) throw std::runtime_error("see the head of bench_scaling.cpp for its arguments");
  const bool alone = words[0] == "alone";
  const int along_x = std::stoi(words[2]), along_z = std::stoi(words[3]), substeps = std::stoi(words[4]);
  if (comm.root()) settled_bed(along_x, along_z);  // the others find it made
  comm.barrier();
  return words[1] == Coulomb::name ? measured<Coulomb>(comm, alone, along_x, along_z, substeps)
                                   : measured<TangentialSpring>(comm, alone, along_x, along_z, substeps);
}

}  // namespace
}  // namespace bedflow

int main(int argc, char** argv) {
  const bedflow::MpiSession session(&argc, &argv);
  const bedflow::Comm comm = bedflow::Comm::world();
  const bedflow::json result = bedflow::answer(comm, {argv + 1, argv + argc});
  if (comm.root()) std::printf("%s\n", result.dump().c_str());
}
