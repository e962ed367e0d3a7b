// What a scene pays for what it does not use: each figure is the time of one scene over that of another that differs in nothing
// else, or of the engine over the bare part. Both take steps in turn in this process; the medians of the pairs' ratios in CPU
// time (phases: wall time) are printed, a line each: name, value, unit, notes.
//
// usage: bench_plan [NAME...]   only what begins so; the bed is that of bench_dem (beds.h)
#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "beds.h"
#include "case/case_scene.h"
#include "simulation.h"

namespace bedflow {
namespace {

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// ---------------------------------------------------------------------------------------------------- scenes

// Parts of a case in which the bed of beds.h lies.
struct Parts {
  double height = 0.45;  // of the box, m
  int layers = 90;       // of cells along it
  std::string kind = "diameter: 0.00249 density: 2526";
  std::string tangential = "coulomb { friction: 0.1 }";
  std::string skin = "skin: 0.000249";
  std::string more = {};  // blocks of the case
  bool particles = true, gas = false;
  bool bed = true;  // else the particles are none
  bool shaken = false;
};

std::string text_of(const Parts& parts) {
  std::ostringstream text;
  text << "name: \"plan\" domain { size { x: 0.15 y: " << parts.height << " z: 0.015 } ";
  if (parts.gas)
    text << "cells { x: 30 y: " << parts.layers
         << " z: 3 } faces { y_low { inflow { velocity: 0.4 } } y_high { outflow { screen: true } } }";
  text << "} gravity { y: -9.81 } ";
  if (parts.gas) text << "gas { density: 1.2 viscosity: 1.8e-5 simple {} smart {} } ";
  if (parts.particles)
    text << "particles { " << parts.kind << " linear_spring_dashpot { stiffness: 2519 restitution: 0.97 } " << parts.tangential
         << " symplectic_euler {} " << parts.skin << " "
         << (parts.bed ? "placed { spheres { position { x: 0.1 y: 0.1 z: 0.01 } } }" : "random { count: 0 seed: 1 }") << " } ";
  if (parts.gas && parts.particles) text << "coupling { gidaspow_blended {} hat {} explicit {} } ";
  text << "time { end: 1000 " << (parts.particles ? "substeps: 20" : "step: 2e-4") << " } " << parts.more;
  return text.str();
}

// A whole simulation of a scene, at the bed's state at rest; after some steps.
class Engine {
 public:
  explicit Engine(const Parts& parts, int steps = 3) : plan_(plan_of(parts)), simulation_(plan_, self_, timer_) {
    simulation_.seed();
    for (int s = 0; s < steps; ++s) step();
    timer_.restart();
  }
  void step() {
    simulation_.step();
    if (simulation_.failure()) throw std::runtime_error(simulation_.failure().message);
  }
  const Plan& plan() const { return plan_; }
  Simulation& simulation() { return simulation_; }
  double seconds(std::initializer_list<Phase> phases) const {
    double sum = 0;
    for (const Phase phase : phases) sum += timer_[phase].seconds;
    return sum;
  }

 private:
  static Plan plan_of(const Parts& parts) {
    Scene scene = scene_of(text_of(parts));
    if (parts.particles && parts.bed) scene.particles->regions = {{"the settled bed", settled_bed().spheres}};
    return make_plan(scene, 1);
  }
  Comm self_ = Comm::self();
  PhaseTimer timer_;
  Plan plan_;
  Simulation simulation_;
};

// ---------------------------------------------------------------------------------------------------- measuring

using Step = std::function<void()>;

// The time of `one` over that of `other`: of so many pairs of so many steps, each side first in every second pair.
double ratio(const Step& one, const Step& other, int pairs, int steps) {
  const auto seconds = [&](const Step& step) {
    const double start = cpu_seconds();
    for (int s = 0; s < steps; ++s) step();
    return cpu_seconds() - start;
  };
  std::vector<double> ratios;
  for (int pair = 0; pair < pairs; ++pair) {
    double first = 0, second = 0;
    if (pair % 2 == 0) first = seconds(one), second = seconds(other);
    if (pair % 2 != 0) second = seconds(other), first = seconds(one);
    ratios.push_back(first / second);
  }
  return median(ratios);
}
double ratio(Engine& one, Engine& other, int pairs = 15, int steps = 3) {
  return ratio([&] { one.step(); }, [&] { other.step(); }, pairs, steps);
}
// The same of some phases, by the fastest of so many steps of each: wall time that others have not taken from.
double ratio(Engine& one, Engine& other, std::initializer_list<Phase> phases, int steps = 40) {
  double fastest[2] = {1e9, 1e9};
  Engine* const engines[] = {&one, &other};
  for (int s = 0; s < steps; ++s)
    for (int side = 0; side < 2; ++side) {
      const double start = engines[side]->seconds(phases);
      engines[side]->step();
      fastest[side] = std::min(fastest[side], engines[side]->seconds(phases) - start);
    }
  return fastest[0] / fastest[1];
}

void print(const std::string& name, double value, const std::string& unit, const std::string& notes = "") {
  std::printf("plan/%s, %.4g, %s%s%s\n", name.c_str(), value, unit.c_str(), notes.empty() ? "" : ", ", notes.c_str());
  std::fflush(stdout);
}

// ---------------------------------------------------------------------------------------------------- pairs of scenes

void particles_alone() {
  Engine whole({});
  BedScene bare(settled_bed(), bed_laws("coulomb", 1), false);
  const Plan& plan = whole.plan();
  const Step sweep = [&] { bare.dem.advance(plan.substeps, plan.substep); };
  for (int s = 0; s < 3; ++s) sweep();
  print("particles_alone", ratio([&] { whole.step(); }, sweep, 15, 3), "times the bare sweeps and motion");
}

void gas_alone() {
  Engine whole({.particles = false, .gas = true}, 20);
  const Plan& plan = whole.plan();
  PhaseTimer timer;
  const Decomposition decomposition(Comm::self(), plan.cells, plan.scene.size, plan.scene.periodic);
  const Grid grid(decomposition, plan.ghosts);
  Halo halo(decomposition, grid, timer);
  GasState state(grid);
  GasSolver solver(decomposition, grid, halo, plan.scene.gas->setup, timer);
  solver.prepare(state, 0);
  double time = 0;
  const Step advance = [&] {
    solver.advance(state, nullptr, time, plan.step);
    time += plan.step;
  };
  for (int s = 0; s < 20; ++s) advance();
  print("gas_alone", ratio([&] { whole.step(); }, advance, 31, 5), "times the bare solver");
}

void laws() {
  Engine frictionless({.tangential = "frictionless {}"}), coulomb({}), spring({.tangential = "spring { friction: 0.1 }"});
  print("frictionless", ratio(frictionless, coulomb), "times coulomb");
  print("no_history", ratio(coulomb, spring), "times spring");
}

void one_size() {
  Engine one({});
  Engine listed({.kind = "types { name: \"all\" density: 2526 constant { diameter: 0.00249 } }"});
  Engine classes({.kind = "types { name: \"all\" density: 2526 discrete { classes { diameter: 0.00249 share: 1 } } }"});
  print("one_size/listed", ratio(listed, one), "times the same without a list");
  print("one_size/one_class", ratio(classes, one), "times the same without a list");
}

void walls() {
  Engine without({});
  Engine with({.more = "walls { name: \"far\" cylinder { from { x: 0.05 y: 0.4 z: 0.0075 } to { x: 0.1 y: 0.4 z: 0.0075 } "
                       "radius: 0.005 } }"});
  print("walls_far_away", ratio(with, without), "times without walls");
}

void energy_watch() {
  Engine with({}), without({.more = "guard { energy: 0 }"});
  print("energy_watch", ratio(with, without), "times without guard.energy");
}

void freeboard() {
  Engine tall({.height = 1.8, .layers = 360, .gas = true}, 10), low({.height = 0.225, .layers = 45, .gas = true}, 10);
  using enum Phase;
  print("freeboard/transfer", ratio(tall, low, {deposit, sample}), "times a box of an eighth of the height");
  print("freeboard/particles", ratio(tall, low, {pairs, contacts, walls, integration, migration}),
        "times a box of an eighth of the height");
}

void no_particles() {
  Engine coupled({.gas = true, .bed = false}, 20), gas({.particles = false, .gas = true}, 20);
  print("empty_bed", ratio(coupled, gas, 31, 5), "times the gas alone");
}

// Hardly anything moves; a few bounce on its surface for long.
void resting() {
  Engine bed({.tangential = "spring { friction: 0.1 }", .skin = ""}, 100);  // the skin has been tuned by then
  const Dem& dem = *bed.simulation().particles();
  const std::int64_t before = dem.rebuilds();
  constexpr int steps = 100;
  for (int s = 0; s < steps; ++s) bed.step();
  const double substeps = steps * bed.plan().substeps;
  using enum Phase;
  print("resting/rebuilds", 1000 * static_cast<double>(dem.rebuilds() - before) / substeps, "in 1000 sub-steps");
  print("resting/lists", 100 * bed.seconds({pairs}) / bed.seconds({pairs, contacts, walls, integration}),
        "% of the particles' time");
}

}  // namespace
}  // namespace bedflow

int main(int argc, char** argv) {
  using namespace bedflow;
  const MpiSession session(&argc, &argv);
  mallopt(M_MMAP_THRESHOLD, 1 << 20);  // as bedflow-engine does
  const std::pair<const char*, void (*)()> groups[] = {
      {"particles_alone", particles_alone},
      {"gas_alone", gas_alone},
      {"laws", laws},
      {"one_size", one_size},
      {"walls", walls},
      {"energy_watch", energy_watch},
      {"freeboard", freeboard},
      {"empty_bed", no_particles},
      {"resting", resting},
  };
  for (const auto& [name, run] : groups) {
    const auto asked = [&, known = std::string(name)](const char* argument) { return known.starts_with(argument); };
    if (argc == 1 || std::any_of(argv + 1, argv + argc, asked)) run();
  }
}
