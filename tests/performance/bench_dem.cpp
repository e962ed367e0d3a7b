// µs per particle and sub-step of the whole particle side: contacts, walls, integration, pair list; and bytes per particle.
//
// settled: at rest under its weight. agitated: the settled bed's first period of shaking, pressed together and then thrown up.
// million: 42 beds side by side, settled. Each with its contacts per particle, and with what one core could do at best.
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "beds.h"
#include "hardware.h"

namespace bedflow {
namespace {

constexpr int gas_step = 20;  // sub-steps

template <class Law>
class MovingBed {
 public:
  MovingBed(const Bed& bed, bool shaken) : shaken_(shaken), scene_(Comm::self(), bed.box, bed_spheres(), {8, 8, 8}, shaken) {
    scene_.place(bed.spheres);
  }
  void advance() {
    std::vector<Vec3>& push = scene_.dem.particles().gas_force;
    if (shaken_) std::fill(push.begin(), push.end(), Vec3{0, bed_spheres().mass() * shaking(time_), 0});
    scene_.advance(gas_step, bed_substep);
    time_ += gas_step * bed_substep;
  }
  const Dem& dem() const { return scene_.dem; }
  double count() const { return static_cast<double>(scene_.dem.particles().owned); }
  double contacts_per_particle() const { return 2.0 * static_cast<double>(scene_.dem.contact_count()) / count(); }

 private:
  bool shaken_;
  double time_ = 0;
  Scene<Law> scene_;
};

// Least time of a particle and sub-step, µs. Two passes, contacts and motion, stream the row, the third component of ω, force
// and torque of a particle to and fro, the second reads its place at the last rebuild; its pairs, and the ξ of its contacts, are
// read once. Arithmetic as the equations of contact_sweep.h, the laws and integrate.h have it.
struct Bound {
  double memory, arithmetic;
};
template <class Law>
Bound bound(double particles, double pairs, double contacts) {
  const double row = 64 + 8, forces = Law::rotation ? 48 : 24, history = Law::history ? 24 : 0;
  const double bytes = 2 * (2 * row + 2 * forces) + 24 + pairs * (8 + 2 * history);
  const double resident = row + forces + 24 + pairs * (8 + history);
  const double flops = 8 * pairs + contacts * (32 + (Law::rotation ? 48 : 0) + (Law::history ? 60 : 0)) + 24;
  const double roots = contacts * (2 + (Law::rotation ? 2 : 0) + (Law::history ? 3 : 0));
  return {bytes / triad_bandwidth(static_cast<std::size_t>(particles * resident)) * 1e6,
          (flops / peak_flops() + roots / peak_roots()) * 1e6};
}

template <class Law>
void sub_steps(benchmark::State& state, int along_x, int along_z, bool shaken) {
  const Bed bed = settled_bed(along_x, along_z);
  MovingBed<Law> moving(bed, shaken);
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
  const Bound least = bound<Law>(moving.count(), 3.8, contacts / 2);
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
template <class Law>
void memory(benchmark::State& state) {
  for (auto _ : state) {
    if (!std::filesystem::exists(settled_bed_path(1, 8))) {
      settled_bed(1, 8);
      state.SkipWithError("the bed had to be made, which leaves its memory behind: run this again");
      return;
    }
    const double before = resident_bytes();
    MovingBed<Law> moving(settled_bed(1, 8), true);
    while (moving.dem().rebuilds() == 0) moving.advance();
    state.counters["figure"] = (resident_bytes() - before) / moving.count();
  }
  state.SetLabel("bytes per particle");
}

template <class Law>
void add() {
  const std::string law = Law::name;
  const auto sweep = [&](const char* name, int iterations, int along_x, int along_z, bool shaken) {
    benchmark::RegisterBenchmark((law + name).c_str(),
                                 [=](benchmark::State& state) { sub_steps<Law>(state, along_x, along_z, shaken); })
        ->Iterations(iterations)
        ->Unit(benchmark::kMillisecond);
  };
  sweep("/settled", 50, 1, 1, false);
  sweep("/agitated", static_cast<int>(shaking_period / (gas_step * bed_substep)), 1, 1, true);
  sweep("/million", 5, 6, 7, false);
  benchmark::RegisterBenchmark((law + "/memory").c_str(), memory<Law>)->Iterations(1);
}

}  // namespace
}  // namespace bedflow

int main(int argc, char** argv) {
  const bedflow::MpiSession session(&argc, &argv);
  mallopt(M_MMAP_THRESHOLD, 1 << 20);  // as bedflow-engine does
  benchmark::Initialize(&argc, argv);
  bedflow::add<bedflow::Frictionless>();
  bedflow::add<bedflow::Coulomb>();
  bedflow::add<bedflow::TangentialSpring>();
  benchmark::RunSpecifiedBenchmarks();
}
