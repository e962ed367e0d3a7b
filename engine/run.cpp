#include "run_loop.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <new>
#include <sstream>
#include <system_error>

#include "balance.h"
#include "base/short_number.h"
#include "case/case_scene.h"
#include "checkpoint/file_names.h"
#include "checkpoint/held_checkpoint.h"
#include "statistics_state.h"

namespace bedflow {

namespace {

constexpr const char* packing_name = "packing.h5";

volatile std::sig_atomic_t signal_checkpoint = 0, signal_stop = 0;

void listen_to_signals() {
  std::signal(SIGUSR1, [](int) { signal_checkpoint = 1; });
  std::signal(SIGTERM, [](int) { signal_stop = 1; });
  std::signal(SIGINT, [](int) { signal_stop = 1; });
}

// Of this process, all its threads.
double cpu_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// The scene with steps and sub-steps halved so many times.
Scene halved(Scene scene, int halvings, int ranks) {
  if (halvings == 0) return scene;
  const double factor = std::ldexp(1.0, -halvings);
  scene.step = factor * make_plan(scene, ranks).step;
  scene.substeps.reset();
  if (scene.longest_step) *scene.longest_step *= factor;
  if (scene.shortest_step) scene.shortest_step = std::min(*scene.shortest_step, *scene.step);
  if (scene.particles) scene.particles->steps_per_collision /= factor;
  return scene;
}

}  // namespace

Run::Run(const Comm& comm, const RunOptions& options)
    : comm_(comm),
      options_(options),
      policy_(read_policy(options.folder)),
      folder_(comm, options.folder, options.epoch, policy_.go_on_when_full) {}

Reason Run::run() {
  Stop outcome(Reason::finished, "the end time is reached");
  try {
    start();
    do {
      outcome = advance_to_end();
    } while (go_back(outcome));
  } catch (const Stop& stop) {
    outcome = stop;
  } catch (const std::bad_alloc&) {  // the other ranks may wait for this one: say it, and end them all
    const std::string text = "rank " + std::to_string(comm_.rank()) + " of " + std::to_string(comm_.size()) +
                             " is out of memory; `bedflow explain` says what the scene needs";
    std::fprintf(stderr, "bedflow-engine: %s\n", text.c_str());
    folder_.stopped(Reason::out_of_memory, text, simulation_ ? simulation_->steps() : 0, simulation_ ? simulation_->time() : 0);
    comm_.abort(static_cast<int>(Reason::out_of_memory));
  }
  finish(outcome);
  return outcome.reason;
}

void Run::start() {
  timer_.set_pulse([this] { folder_.heartbeat().beat(); });
  scene_ = read_scene(options_.folder / "case.txtpb");
  plan_with(0);
  const std::string from = begin();
  const bool packed = from == packing_name;
  folder_.started(comm_.size(), simulation_->steps(), simulation_->time(), plan_.scene.end_time, from, plan_.text());
  for (const std::string& warning : plan_.warnings) folder_.warning(warning);
  for (const std::string& fault : checkpoint_faults_) folder_.warning(fault);
  report_schema();
  if (!from.empty() && !packed) {
    folder_.statistics_resumed(simulation_->steps());
    begin_totals();
    return;
  }
  folder_.statistics_resumed(0);  // an earlier attempt that never got to a checkpoint is void
  if (!packed) settle();
  balance();
  begin_totals();
  monitors_->observe(simulation_->observation(), 0, 0, 0);
  write_plots();
  write_checkpoint_now();  // settling is never done twice
}

// The summary is of the steps.
void Run::begin_totals() {
  timer_.restart();
  totals_.cpu_seconds = -cpu_seconds();
}

// The plan of the case, its steps halved so many times.
void Run::plan_with(int halvings) {
  halvings_ = halvings;
  plan_ = make_plan(halved(scene_, halvings, comm_.size()), comm_.size());
  monitors_ = std::make_unique<Monitors>(StatisticScene{plan_.scene.size, plan_.cells}, plan_.scene.monitors, sink());
}

// Takes up the newest good checkpoint, or the one asked for, and says its name; else the state at time 0, of the packing that the
// folder may have.
std::string Run::begin() {
  const Heartbeat::Meanwhile meanwhile(folder_.heartbeat(), std::chrono::minutes(10));  // much may have to be read
  const auto checkpoints = options_.folder / "checkpoints";
  std::optional<CheckpointInfo> found;
  if (options_.from) {
    char name[40];
    std::snprintf(name, sizeof name, "checkpoint_%010llu.h5", static_cast<unsigned long long>(*options_.from));
    found = CheckpointInfo{checkpoints / name, *options_.from, 0, 0};
  } else {
    found = newest_good_checkpoint(comm_, checkpoints, checkpoint_faults_);
    if (!found && !checkpoint_faults_.empty()) {
      throw Stop(Reason::checkpoint_corrupt,
                 "no checkpoint of " + checkpoints.string() + " is good: " + checkpoint_faults_.front());
    }
  }
  if (!found) {
    simulation_ = std::make_unique<Simulation>(plan_, comm_, timer_);
    const auto packing = options_.folder / packing_name;
    const bool packed = comm_.any(comm_.root() && std::filesystem::exists(packing));
    if (packed)
      simulation_->seed_from(CheckpointReader(comm_, packing));
    else
      simulation_->seed();
    balance();
    return packed ? packing_name : "";
  }
  const CheckpointReader reader(comm_, found->path);
  if (reader.has_number("guard/halvings") && reader.number("guard/halvings") > halvings_) {
    plan_with(static_cast<int>(reader.number("guard/halvings")));
  }
  const std::optional<Cuts> blocks = Simulation::blocks_of(reader, comm_);
  simulation_ = blocks && fit(*blocks, plan_) ? std::make_unique<Simulation>(plan_, comm_, timer_, *blocks)
                                              : std::make_unique<Simulation>(plan_, comm_, timer_);
  simulation_->restore(reader);
  if (blocks != simulation_->decomposition().cuts()) balance();
  if (!restore_statistics(reader, *monitors_)) {
    folder_.info("the monitors are not those of the checkpoint: statistics begin here");
  }
  last_checkpoint_time_ = simulation_->time();
  last_checkpoint_step_ = simulation_->steps();
  if (comm_.root() && policy_.keep_every_nth > 0) since_kept_ = checkpoints_since_kept(options_.folder);
  good_checkpoint_step_ = found->step;
  next_plot_ =
      plan_.scene.plot_interval ? static_cast<std::int64_t>(simulation_->time() / *plan_.scene.plot_interval + 1e-9) + 1 : 0;
  return found->path.filename().string();
}

void Run::settle() {
  while (simulation_->settle()) {
    const Agreement agreed = agree();
    if (agreed.failure) throw Stop(agreed.failure.reason, "while settling: " + agreed.failure.message);
    if (agreed.cancel || agreed.cancel_now) throw Stop(Reason::cancelled, "cancelled while settling");
    if (agreed.suspend) throw Stop(Reason::suspended, "suspended while settling; it begins anew when resumed");
    report_progress("settling");
  }
  settling_seconds_ = timer_.seconds();
  if (simulation_->settled_time() > 0) {
    folder_.info("the particles were given " + std::to_string(simulation_->settled_time()) + " s to settle");
  }
}

// After trouble with the numbers, as often as the case says: to the last checkpoint, and on from there with half the step.
bool Run::go_back(const Stop& trouble) {
  const bool numerical =
      trouble.reason == Reason::diverged || trouble.reason == Reason::not_converged || trouble.reason == Reason::particle_lost;
  if (!numerical || halvings_ >= scene_.guard.retries) return false;
  count_rebuilds();
  plan_with(halvings_ + 1);
  options_.from.reset();
  const std::string from = begin();
  folder_.statistics_resumed(simulation_->steps());
  folder_.warning(std::string(trouble.what()) + "; back to " + from +
                  " and on with half the step, dt = " + short_number(plan_.step) + " s (" + std::to_string(halvings_) +
                  " of guard.retries = " + std::to_string(scene_.guard.retries) + ")");
  return true;
}

Stop Run::advance_to_end() try {
  while (!simulation_->finished()) {
    step();
    count_step();
    {
      const PhaseTimer::Scope scope(timer_, Phase::statistics, simulation_->particle_count());
      monitors_->observe(simulation_->observation(), simulation_->steps(), simulation_->time(), simulation_->last_step(),
                         simulation_->finished());
    }
    for (const std::string& note : simulation_->take_notes()) folder_.info(note);
    write_plots_due();
    report_progress("running");
    const Agreement agreed = agree();
    if (agreed.failure)
      return {agreed.failure.reason, agreed.failure.message + ", in step " + std::to_string(simulation_->steps())};
    if (agreed.cancel_now) return {Reason::cancelled, "cancelled without a checkpoint"};
    if (simulation_->steps() % static_cast<std::uint64_t>(plan_.balance_steps) == 0) balance();
    if (agreed.checkpoint || agreed.suspend || agreed.cancel || agreed.wall_limit) write_checkpoint_now();
    if (agreed.cancel) return {Reason::cancelled, "cancelled; the last checkpoint is kept"};
    if (agreed.suspend) return {Reason::suspended, "suspended" + at_checkpoint()};
    if (agreed.wall_limit)
      return {Reason::wall_limit, "the wall limit of the job is over" + at_checkpoint() + ": resume the job with a longer one"};
  }
  if (last_checkpoint_step_ != simulation_->steps()) write_checkpoint_now();
  return {Reason::finished, "the end time is reached"};
} catch (const Stop& stop) {
  return stop;
}

// Moves the cuts between the blocks where that pays: the state goes over as by a checkpoint. Ahead of a checkpoint that is due
// in the same step, so that who resumes from it goes on with these blocks.
void Run::balance() {
  const PhaseTimer::Scope scope(timer_, Phase::balance);
  const std::optional<Cuts> cuts = better_cuts(simulation_->decomposition(), plan_, simulation_->particles());
  if (!cuts) return;
  const HeldCheckpoint held(comm_, simulation_->checkpoint());
  count_rebuilds();
  simulation_.reset();
  simulation_ = std::make_unique<Simulation>(plan_, comm_, timer_, *cuts);
  simulation_->restore(held);
  ++totals_.block_moves;
}

void Run::count_rebuilds() {
  if (const Dem* dem = simulation_->particles()) totals_.list_rebuilds += static_cast<std::uint64_t>(dem->rebuilds());
}

void Run::finish(Stop& outcome) {
  if (comm_.any(folder_.is_removed())) outcome = Stop(Reason::folder_removed, removed_text());
  if (outcome.reason == Reason::stale_epoch ||
      outcome.reason == Reason::folder_removed) {  // it is the later attempt's, or nobody's
    folder_.leave();
    if (comm_.root()) std::fprintf(stderr, "bedflow-engine: %s\n", outcome.what());
    return;
  }
  folder_.sync();
  if (outcome.reason == Reason::finished && comm_.any(folder_.has_unwritten())) {
    outcome = Stop(Reason::disk_full,
                   "the end time is reached, but the disk has no room for the last of the events and "
                   "statistics; make room on it, then resume the job: it ends once more");
  }
  const std::uint64_t steps = simulation_ ? simulation_->steps() : 0;
  const double time = simulation_ ? simulation_->time() : 0;
  if (simulation_) {
    totals_.reason = outcome.reason;
    totals_.cpu_seconds += cpu_seconds();
    totals_.settling_seconds = settling_seconds_;
    totals_.particles = simulation_->particle_count();
    totals_.turnover = simulation_->turnover();
    totals_.sizes = simulation_->size_moments();
    if (const Insertion* insertion = simulation_->insertion()) {
      totals_.mass_due = insertion->mass_due(simulation_->time());
      for (const InletState& state : insertion->states()) totals_.blocked_steps += static_cast<std::uint64_t>(state.blocked);
    }
    count_rebuilds();
    try {
      write_summary(comm_, options_.folder / "summary.json", plan_, timer_, totals_);
    } catch (const std::system_error& error) {
      folder_.warning(std::string("summary.json could not be written: ") + error.what());
    }
  }
  if (outcome.reason != Reason::finished && outcome.reason != Reason::suspended && outcome.reason != Reason::cancelled) {
    folder_.error(outcome.what());
  }
  folder_.stopped(outcome.reason, outcome.what(), steps, time);
  comm_.barrier();  // the last event is there before any rank is gone
}

// One reduction: does any rank report a failure, a signal or a command?
Run::Agreement Run::agree() {
  Failure mine = simulation_->failure();
  if (!mine) mine = folder_.failure();
  if (!mine) mine = lost_folder();
  const Command command = folder_.poll();
  std::array<double, 6> flags{};
  flags[0] = static_cast<bool>(mine);
  flags[1] = command == Command::checkpoint || signal_checkpoint || checkpoint_due();
  flags[2] = command == Command::suspend || signal_stop;
  flags[3] = command == Command::cancel;
  flags[4] = command == Command::cancel_now;
  flags[5] = command == Command::limit || (comm_.root() && policy_.wall_limit > 0 && wall_seconds() > policy_.wall_limit);
  signal_checkpoint = 0;
  comm_.sum(flags);
  Agreement agreed{{}, flags[1] > 0, flags[2] > 0, flags[3] > 0, flags[4] > 0, flags[5] > 0};
  if (flags[0] > 0) {
    const int first = static_cast<int>(comm_.min(mine ? comm_.rank() : comm_.size()));
    auto reason = static_cast<int>(mine.reason);
    comm_.broadcast(std::as_writable_bytes(std::span(&reason, 1)), first);
    agreed.failure = {static_cast<Reason>(reason), comm_.broadcast(mine.message, first)};
  }
  return agreed;
}

std::string Run::removed_text() const {
  return "the job folder " + options_.folder.string() + " has been removed: there is nowhere to write to, and the run ends";
}

// Gone, or another attempt's at the job: from now on nothing is written.
Failure Run::lost_folder() {
  if (!comm_.root() || wall_seconds() < next_look_) return {};
  next_look_ = wall_seconds() + 0.1;
  if (folder_.is_removed()) {
    folder_.leave();
    return {Reason::folder_removed, removed_text()};
  }
  if (options_.epoch == 0) return {};
  const std::uint64_t newest = newest_attempt(options_.folder);
  if (newest <= options_.epoch) return {};
  folder_.leave();
  return {Reason::stale_epoch,
          "attempt " + std::to_string(newest) + " has taken this job over from attempt " + std::to_string(options_.epoch)};
}

bool Run::checkpoint_due() const {
  if (!comm_.root()) return false;
  const std::uint64_t step = simulation_->steps();
  const bool by_steps = policy_.checkpoint_steps > 0 && step - last_checkpoint_step_ >= policy_.checkpoint_steps;
  const bool by_time = policy_.checkpoint_simulated > 0 &&
                       simulation_->time() - last_checkpoint_time_ >= policy_.checkpoint_simulated * (1 - 1e-9);
  const bool by_wall = policy_.checkpoint_wall > 0 && wall_seconds() - last_checkpoint_wall_ >= policy_.checkpoint_wall;
  return by_steps || by_time || by_wall;
}

void Run::step() {
  const double start = wall_seconds();
  const Traffic before = comm_.traffic();
  simulation_->step();
  totals_.traffic += comm_.traffic() - before;
  totals_.step_seconds += wall_seconds() - start;
}

void Run::count_step() {
  ++totals_.steps;
  totals_.simulated_seconds += simulation_->last_step();
  const auto particles = static_cast<std::uint64_t>(simulation_->particle_count());
  totals_.particle_steps += particles;
  const auto substeps = static_cast<std::uint64_t>(simulation_->last_substeps());
  totals_.particle_substeps += substeps * particles;
  totals_.substeps += substeps;
  totals_.cell_steps += static_cast<std::uint64_t>(plan_.cell_count);
  totals_.gas_iterations += static_cast<std::uint64_t>(simulation_->gas_outcome().iterations);
  totals_.pressure_iterations += static_cast<std::uint64_t>(simulation_->gas_outcome().pressure_iterations);
}

Reason run(const Comm& comm, const RunOptions& options) {
  listen_to_signals();
  return Run(comm, options).run();
}

}  // namespace bedflow
