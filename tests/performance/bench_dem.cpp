// ns per particle and sub-step of the whole particle side: contacts, walls, integration, pair list.
//
// The bed: 24 750 spheres of 2.49 mm (Goldschmidt), τ/20, in a box of 150 × 450 × 15 mm with six walls. Settled: at rest under
// its weight. Agitated: shaken 5 mm at 15 Hz, which forces rebuilds of the list.
#include <benchmark/benchmark.h>

#include <numbers>

#include "parallel/comm.h"
#include "support/dem_scene.h"

namespace bedflow {
namespace {

constexpr std::int64_t count = 24750;
constexpr Vec3 box{0.15, 0.45, 0.015};
constexpr double dt = 1e-5;

Spheres goldschmidt() {
  Spheres spheres;
  spheres.diameter = 2.49e-3;
  spheres.density = 2526;
  spheres.stiffness = 2519;
  spheres.gravity = {0, -9.81, 0};
  spheres.skin = 0.1 * spheres.diameter;
  return spheres;
}

// Falls under three times its weight, nearly without rebound, and then comes to rest under its own.
ParticleStore settled_bed() {
  Spheres heavy = goldschmidt(), dull = goldschmidt();
  heavy.gravity.y *= 3;
  heavy.restitution = dull.restitution = 0.1;
  Scene<Coulomb> falling(Comm::self(), box, heavy), resting(Comm::self(), box, dull);
  falling.seed({count, 1, {0, 0, 0}, {box.x, 0.33, box.z}, 0});
  falling.advance(12000, dt);
  resting.dem.restore(falling.dem.particles(), {}, {}, {});
  resting.advance(15000, dt);
  return resting.dem.particles();
}

template <class Law>
void sub_steps(benchmark::State& state, const ParticleStore& bed, bool agitated) {
  const Spheres spheres = goldschmidt();
  Scene<Law> scene(Comm::self(), box, spheres, {8, 8, 8}, agitated);
  scene.dem.restore(bed, {}, {}, {});
  double time = 0;
  constexpr int substeps = 20;
  const auto gas_step = [&] {
    if (agitated) {
      const double push = spheres.mass() * 44.4 * std::sin(2 * std::numbers::pi * 15 * time);
      std::fill(scene.dem.particles().gas_force.begin(), scene.dem.particles().gas_force.end(), Vec3{0, push, 0});
    }
    scene.advance(substeps, dt);
    time += substeps * dt;
  };
  for (int i = 0; i < (agitated ? 200 : 10); ++i) gas_step();
  const std::int64_t before = scene.dem.rebuilds();
  double done = 0;
  for (auto _ : state) {
    gas_step();
    done += substeps * static_cast<double>(count);
  }
  if (scene.dem.failure()) state.SkipWithError(scene.dem.failure().message.c_str());
  state.SetLabel("us per particle and sub-step");
  state.counters["figure"] = benchmark::Counter(done * 1e-6, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  // Streamed once in each of two passes from beyond the caches (14 GB/s): x, v, ω, force, torque, place; pairs and ξ beside them.
  const double bytes = 2 * 5 * 24 + 24 + 4 * (8 + (Law::history ? 48 : 0));
  state.counters["roofline"] = bytes / 14e9 * 1e6;
  state.counters["contacts_per_particle"] = 2.0 * static_cast<double>(scene.dem.contacts()) / static_cast<double>(count);
  state.counters["substeps_per_rebuild"] =
      done / static_cast<double>(count) / static_cast<double>(std::max<std::int64_t>(scene.dem.rebuilds() - before, 1));
  for (const Phase phase : {Phase::pairs, Phase::contacts, Phase::walls, Phase::integration, Phase::migration})
    state.counters[std::string(phase_names[static_cast<int>(phase)]) + "_share"] =
        scene.timer[phase].seconds / scene.timer.seconds();
}

template <class Law>
void add(const ParticleStore& bed) {
  for (const bool agitated : {false, true}) {
    const std::string name = std::string(Law::name) + (agitated ? "/agitated" : "/settled");
    benchmark::RegisterBenchmark(name.c_str(), [&bed, agitated](benchmark::State& state) {
      sub_steps<Law>(state, bed, agitated);
    })->Unit(benchmark::kMillisecond);
  }
}

}  // namespace
}  // namespace bedflow

int main(int argc, char** argv) {
  const bedflow::MpiSession session(&argc, &argv);
  benchmark::Initialize(&argc, argv);
  const bedflow::ParticleStore bed = bedflow::settled_bed();
  bedflow::add<bedflow::Frictionless>(bed);
  bedflow::add<bedflow::Coulomb>(bed);
  bedflow::add<bedflow::TangentialSpring>(bed);
  benchmark::RunSpecifiedBenchmarks();
}
