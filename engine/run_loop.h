// The loop over time of a job folder, its parts and what they share; for run.cpp and run_output.cpp alone.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "report/job_folder.h"
#include "run.h"
#include "simulation.h"
#include "statistics/monitors.h"
#include "summary.h"

namespace bedflow {

class Run {
 public:
  Run(const Comm& comm, const RunOptions& options);
  Reason run();

 private:
  // What the ranks agree on once a step.
  struct Agreement {
    Failure failure;
    bool checkpoint = false, suspend = false, cancel = false, cancel_now = false, wall_limit = false;
  };

  // ---- in order
  void start();
  void plan_with(int halvings);
  std::string begin();
  void begin_totals();
  void settle();
  Stop advance_to_end();
  bool go_back(const Stop& trouble);
  void balance();
  void finish(Stop& outcome);

  // ---- once a step
  void step();
  void count_step();
  void count_rebuilds();
  Agreement agree();
  Failure lost_folder();
  std::string removed_text() const;
  bool checkpoint_due() const;

  // ---- what is written (run_output.cpp)
  void report_progress(const char* phase);
  void report_schema();
  StatisticsSink sink();
  void write_checkpoint_now();
  bool checkpoint_stays();
  std::string at_checkpoint() const;
  std::string case_text() const;
  void write_plots_due();
  void write_plots();

  double wall_seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }

  const Comm& comm_;
  RunOptions options_;
  RunPolicy policy_;
  JobFolder folder_;
  PhaseTimer timer_;
  Scene scene_;  // of the case
  int halvings_ = 0;
  Plan plan_;  // of the scene with its steps halved so many times
  std::unique_ptr<Simulation> simulation_;
  std::unique_ptr<Monitors> monitors_;
  RunTotals totals_;
  std::vector<std::string> checkpoint_faults_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  double next_look_ = 0, last_progress_ = 0, last_checkpoint_time_ = 0, last_checkpoint_wall_ = 0, settling_seconds_ = 0;
  std::uint64_t last_checkpoint_step_ = 0;  // written, or tried
  std::uint64_t since_kept_ = 0;            // checkpoints since the last that stays by policy_.keep_every_nth; on rank 0
  std::optional<std::uint64_t> good_checkpoint_step_;
  std::int64_t next_plot_ = 0;
};

}  // namespace bedflow
