// µs per particle and sub-step of the whole particle side: contacts, walls, integration, pair list; and bytes per particle.
//
// settled: at rest under its weight. agitated: the settled bed's first period of shaking, pressed together and then thrown up.
// million: 42 beds side by side, settled. two_sizes: every second sphere of half the diameter, settled. Each with its contacts
// per particle, and with what one core could do at best.
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <string>

#include "beds.h"
#include "hardware.h"

namespace bedflow {
namespace {

constexpr int gas_step = 20;  // sub-steps

class MovingBed {
 public:
  MovingBed(const Bed& bed, const ContactLaws& laws, double dt, bool shaken)
      : dt_(dt), shaken_(shaken), scene_(bed, laws, shaken) {}
  void advance() {
    std::vector<Vec3>& push = scene_.dem.particles().gas_force;
    if (shaken_) std::fill(push.begin(), push.end(), Vec3{0, bed_spheres().mass() * shaking(time_), 0});
    scene_.dem.advance(gas_step, dt_);
    time_ += gas_step * dt_;
  }
  const Dem& dem() const { return scene_.dem; }
  double count() const { return static_cast<double>(scene_.dem.particles().owned); }
  double contacts_per_particle() const { return 2.0 * static_cast<double>(scene_.dem.contact_count()) / count(); }

 private:
  double dt_;
  bool shaken_;
  double time_ = 0;
  BedScene scene_;
};

// Least time of a particle and sub-step, µs. Two passes, contacts and motion, stream the row, the third component of ω and the
// force of a particle to and fro, the second reads its place at the last rebuild; the pairs of the list are read once, the memory
// of touching ones to and fro. Arithmetic as the equations of pair_sweep.h, the laws and integrate.h have it.
struct Bound {
  double memory, arithmetic;
};
Bound bound(double particles, double contacts, bool rotation, bool history) {
  constexpr double pairs = 3.8, row = 64 + 8, force = 64, place = 24, pair = 8, memory = 32;
  const double bytes = 2 * 2 * (row + force) + place + pairs * pair + (history ? contacts * 2 * memory : 0);
  const double resident = row + force + place + pairs * (pair + (history ? memory : 0));
  const double flops = 8 * pairs + contacts * (32 + (rotation ? 48 : 0) + (history ? 60 : 0)) + 24;
  const double roots = contacts * (2 + (rotation ? 2 : 0) + (history ? 3 : 0));
  return {bytes / triad_bandwidth(static_cast<std::size_t>(particles * resident)) * 1e6,
          (flops / peak_flops() + roots / peak_roots()) * 1e6};
}

void sub_steps(benchmark::State& state, const Bed& bed, const ContactLaws& laws, double dt, bool shaken) {
  MovingBed moving(bed, laws, dt, shaken);
  for (int i = 0; i < (shaken ? 0 : 10); ++i) moving.advance();
  const std::int64_t before = moving.dem().rebuilds();
  double done = 0, contacts = 0;
  for (auto _ : state) {
    moving.advance();
    ++done;
    contacts += moving.contacts_per_particle();
  }
  if (moving.dem().failure()) state.SkipWithError(moving.dem().failure().message.c_str());
  contacts /= done;
  const Bound least = bound(moving.count(), contacts / 2, laws.rotation(), laws.history());
  state.SetLabel("us per particle and sub-step");
  state.counters["figure"] =
      benchmark::Counter(done * gas_step * moving.count() * 1e-6, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["memory_bound"] = least.memory;
  state.counters["arithmetic_bound"] = least.arithmetic;
  state.counters["bed_height_mm"] = 1e3 * bed.height();
  state.counters["contacts_per_particle"] = contacts;
  state.counters["substeps_per_rebuild"] =
      done * gas_step / static_cast<double>(std::max<std::int64_t>(moving.dem().rebuilds() - before, 1));
}

double resident_bytes() {
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// What 8 beds, with their lists and after a rebuild, add to the resident set of a process that has done nothing else.
void memory(benchmark::State& state, const ContactLaws& laws) {
  for (auto _ : state) {
    if (!std::filesystem::exists(settled_bed_path(1, 8))) {
      settled_bed(1, 8);
      state.SkipWithError("the bed had to be made, which leaves its memory behind: run this again");
      return;
    }
    const double before = resident_bytes();
    MovingBed moving(settled_bed(1, 8), laws, bed_substep, true);
    while (moving.dem().rebuilds() == 0) moving.advance();
    state.counters["figure"] = (resident_bytes() - before) / moving.count();
  }
  state.SetLabel("bytes per particle");
}

void add(const std::string& name, int iterations, const std::function<void(benchmark::State&)>& sweep) {
  benchmark::RegisterBenchmark(name.c_str(), sweep)->Iterations(iterations)->Unit(benchmark::kMillisecond);
}
void add(const std::string& law) {
  const ContactLaws laws = bed_laws(law, 1);
  constexpr int period = static_cast<int>(shaking_period / (gas_step * bed_substep));
  add(law + "/settled", 50, [=](benchmark::State& state) { sub_steps(state, settled_bed(), laws, bed_substep, false); });
  add(law + "/agitated", period, [=](benchmark::State& state) { sub_steps(state, settled_bed(), laws, bed_substep, true); });
  add(law + "/million", 5, [=](benchmark::State& state) { sub_steps(state, settled_bed(6, 7), laws, bed_substep, false); });
  add(law + "/memory", 1, [=](benchmark::State& state) { memory(state, laws); });
  add(law + "/two_sizes", 50,
      [=](benchmark::State& state) { sub_steps(state, settled_bed_of_two_sizes(), bed_laws(law, 2), 0.5 * bed_substep, false); });
}

}  // namespace
}  // namespace bedflow

int main(int argc, char** argv) {
  const bedflow::MpiSession session(&argc, &argv);
  mallopt(M_MMAP_THRESHOLD, 1 << 20);  // as bedflow-engine does
  benchmark::Initialize(&argc, argv);
  for (const char* law : {"frictionless", "coulomb", "spring", "hertz_mindlin"}) bedflow::add(law);
  benchmark::RunSpecifiedBenchmarks();
}
