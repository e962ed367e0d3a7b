// The engine's side of the job folder (layout: proto/bedflow/v1/job.proto): what it is told, and what it reports.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "base/stop.h"
#include "parallel/comm.h"
#include "report/heartbeat.h"

namespace bedflow {

namespace v1 {
class Event;
}

// When checkpoints are written, and how long the run may take. Zero: never, no limit.
struct RunPolicy {
  std::uint64_t checkpoint_steps = 0;
  double checkpoint_simulated = 0;  // s
  double checkpoint_wall = 600;     // s
  int keep = 2;
  std::uint64_t keep_every_nth = 0;
  double keep_every_simulated = 0;  // s
  bool go_on_when_full = false;     // a full disk stops the run otherwise
  std::optional<bool> one_writer;   // of checkpoints; absent: as the disk needs it
  double wall_limit = 0;            // s
};
// From job.txtpb; the defaults of the schema if there is none. Throws Stop(invalid_case) naming line and column.
RunPolicy read_policy(const std::filesystem::path& folder);

// How many checkpoints the folder's events tell of since the last that stays.
std::uint64_t checkpoints_since_kept(const std::filesystem::path& folder);

enum class Command { none, checkpoint, suspend, cancel, cancel_now, limit };  // cancel_now: without a checkpoint

struct ProgressReport {
  std::uint64_t step = 0;
  double time = 0, step_size = 0, end_time = 0;  // s
  double wall_seconds = 0, eta_seconds = -1;     // s; below 0: not known yet
  std::uint64_t substeps = 0, particles = 0;
  int gas_iterations = 0;
  const char* phase = "running";
};

struct CheckpointWrittenReport {
  std::string file;
  std::uint64_t step = 0;
  double time = 0;  // s
  std::uint64_t bytes = 0;
  double seconds = 0;  // that it took
  bool stays = false;
  std::vector<std::uint64_t> removed;  // steps of others
};

struct MonitorReport {
  std::string name, unit, meaning;
  bool profile = false;
  std::vector<double> places;                     // m
  double averaging_start = 0, averaging_bin = 0;  // s
  int averaging_bins = 0;
};

// Rank 0 writes; on the other ranks every call does nothing. A file that cannot be written is kept as failure(), to be voted on.
class JobFolder {
 public:
  // go_on_when_full: what does not fit on the disk waits in memory, up to a bound, and is written when there is room.
  JobFolder(const Comm& comm, std::filesystem::path folder, std::uint32_t epoch, bool go_on_when_full = false);
  ~JobFolder();

  const std::filesystem::path& path() const { return path_; }

  void started(int ranks, std::uint64_t step, double time, double end_time, const std::string& from_checkpoint,
               const std::string& plan);
  void progress(const ProgressReport& now);
  void checkpoint(const CheckpointWrittenReport& report);
  void info(const std::string& text);
  void warning(const std::string& text);
  void error(const std::string& text);
  void stopped(Reason reason, const std::string& message, std::uint64_t step, double time);

  void statistics_schema(const std::vector<MonitorReport>& monitors);
  void statistics_resumed(std::uint64_t step);
  void sample(std::size_t monitor, std::uint64_t step, double time, double value);
  void bin(std::size_t monitor, int bin, std::uint64_t step, std::span<const double> mean, std::span<const double> deviation);
  void sync();                 // both logs to the disk: before a checkpoint is told of
  bool has_unwritten() const;  // something waits for room on the disk
  void leave();                // writes nothing any more: the folder is another attempt's, or is no more
  bool is_removed() const;     // somebody has removed it, or renamed it away

  // Beats and takes control.txtpb (renames it to control.obeyed.txtpb), at most every 100 ms.
  Command poll();
  Heartbeat& heartbeat() { return heartbeat_; }

  const Failure& failure() const { return failure_; }

 private:
  struct Logs;
  template <class Record>
  void append(const Record& record);
  void append_event(v1::Event event);
  void note(const std::system_error& error);
  void log_line(int severity, const std::string& text);

  std::filesystem::path path_;
  std::uint32_t epoch_;
  bool go_on_when_full_;
  Heartbeat heartbeat_;
  std::unique_ptr<Logs> logs_;  // rank 0 only
  Failure failure_;
  std::chrono::steady_clock::time_point last_poll_{};
};

}  // namespace bedflow
