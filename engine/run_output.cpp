// What a run writes: progress, checkpoints, plot files, statistics.
#include <cmath>
#include <fstream>
#include <sstream>

#include "plots.h"
#include "run_loop.h"
#include "statistics_state.h"

namespace bedflow {

void Run::report_progress(const char* phase) {
  if (wall_seconds() - last_progress_ < 0.5 && last_progress_ > 0 && !simulation_->finished()) return;
  last_progress_ = wall_seconds();
  const double done = totals_.simulated_seconds, left = plan_.scene.end_time - simulation_->time();
  const double speed = done / std::max(1e-9, wall_seconds() - settling_seconds_);
  folder_.progress({.step = simulation_->steps(),
                    .time = simulation_->time(),
                    .step_size = simulation_->step_size(),
                    .end_time = plan_.scene.end_time,
                    .wall_seconds = wall_seconds(),
                    .eta_seconds = done > 0 ? std::max(0.0, left / speed) : -1,
                    .substeps = totals_.substeps,
                    .particles = static_cast<std::uint64_t>(simulation_->particle_count()),
                    .gas_iterations = simulation_->gas_outcome().iterations,
                    .phase = phase});
}

void Run::write_checkpoint_now() {
  const PhaseTimer::Scope scope(timer_, Phase::checkpoint);
  constexpr double slowest_disk = 5e6;  // bytes/s
  const Heartbeat::Meanwhile meanwhile(folder_.heartbeat(),
                                       std::chrono::duration<double>(120 + plan_.checkpoint_bytes / slowest_disk));
  const double before = wall_seconds();
  CheckpointContent content = simulation_->checkpoint();
  content.numbers["guard/halvings"] = halvings_;
  add_statistics(*monitors_, content);
  content.arrays.push_back({"case", "", "the effective case, protobuf text format", case_text(), {}, 1});
  const bool stays = checkpoint_stays();
  last_checkpoint_step_ = simulation_->steps();
  last_checkpoint_time_ = simulation_->time();
  folder_.sync();  // statistics up to here are on the disk before the checkpoint is
  try {
    if (comm_.any(folder_.has_unwritten())) throw Stop(Reason::disk_full, "the disk has no room for what comes before it");
    const CheckpointInfo info = write_checkpoint(comm_, options_.folder / "checkpoints", content, {policy_.keep, stays},
                                                 options_.epoch, policy_.one_writer);
    good_checkpoint_step_ = info.step;
    since_kept_ = stays ? 0 : since_kept_ + 1;
    folder_.checkpoint(
        {info.path.filename().string(), info.step, info.time, info.bytes, wall_seconds() - before, stays, info.removed});
  } catch (const Stop& stop) {  // on every rank alike
    if (stop.reason != Reason::disk_full || !policy_.go_on_when_full) throw;
    folder_.warning("no checkpoint of step " + std::to_string(last_checkpoint_step_) + ", the run goes on: " + stop.what());
  }
  last_checkpoint_wall_ = wall_seconds();
}

// By count, and as the first in its span of simulated time.
bool Run::checkpoint_stays() {
  const double span = policy_.keep_every_simulated;
  const auto spans = [&](double time) { return std::floor(time / span * (1 + 1e-12)); };
  const bool by_count = policy_.keep_every_nth > 0 && since_kept_ + 1 >= policy_.keep_every_nth;
  const bool by_time = span > 0 && spans(simulation_->time()) > spans(last_checkpoint_time_);
  return by_count || by_time;
}

// Where the run can be taken up: on a full disk that may be an earlier one than the last that was due.
std::string Run::at_checkpoint() const {
  if (!good_checkpoint_step_) return " without any checkpoint, the disk is full";
  return *good_checkpoint_step_ == simulation_->steps()
             ? " at a checkpoint"
             : "; the newest checkpoint is of step " + std::to_string(*good_checkpoint_step_);
}

std::string Run::case_text() const {
  std::ifstream file(options_.folder / "case.txtpb");
  std::ostringstream text;
  text << file.rdbuf();
  return std::move(text).str();
}

void Run::write_plots_due() {
  if (plan_.scene.plot_interval &&
      simulation_->time() >= static_cast<double>(next_plot_) * *plan_.scene.plot_interval - 1e-9 * simulation_->last_step()) {
    write_plots();
  }
}

void Run::write_plots() {
  if (!plan_.scene.plot_interval) return;
  const PhaseTimer::Scope scope(timer_, Phase::output);
  const Heartbeat::Meanwhile meanwhile(folder_.heartbeat(), std::chrono::minutes(2));
  try {
    write_plot_files(comm_, options_.folder / "plots", *simulation_);
  } catch (const Stop& stop) {
    if (stop.reason != Reason::disk_full || !policy_.go_on_when_full) throw;
    folder_.warning(std::string("no plot files, the run goes on: ") + stop.what());
  }
  next_plot_ = static_cast<std::int64_t>(simulation_->time() / *plan_.scene.plot_interval + 1e-9) + 1;
}

StatisticsSink Run::sink() {
  return {[this](const SampleOut& out) { folder_.sample(out.monitor, out.step, out.time, out.value); },
          [this](const BinOut& out) { folder_.bin(out.monitor, out.bin, out.step, out.mean, out.deviation); }};
}

void Run::report_schema() {
  std::vector<MonitorReport> reports;
  for (std::size_t m = 0; m < monitors_->size(); ++m) {
    const MonitorSetup& setup = monitors_->setup(m);
    reports.push_back({setup.name, monitors_->unit(m), monitors_->meaning(m), monitors_->is_profile(m), monitors_->places(m),
                       setup.averaging_start, setup.averaging_bin, setup.averaging_bins});
  }
  folder_.statistics_schema(reports);
}

}  // namespace bedflow
