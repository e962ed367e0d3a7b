#include "report/job_folder.h"

#include <fcntl.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/text_format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <deque>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>
#include <variant>

#include "bedflow/v1/job.pb.h"
#include "bedflow/v1/results.pb.h"
#include "record_log.h"

namespace bedflow {

// The engine's reasons are the contract's.
static_assert(static_cast<int>(Reason::finished) == v1::FINISHED && static_cast<int>(Reason::suspended) == v1::SUSPENDED &&
              static_cast<int>(Reason::cancelled) == v1::CANCELLED &&
              static_cast<int>(Reason::invalid_case) == v1::INVALID_CASE && static_cast<int>(Reason::diverged) == v1::DIVERGED &&
              static_cast<int>(Reason::not_converged) == v1::NOT_CONVERGED &&
              static_cast<int>(Reason::particle_lost) == v1::PARTICLE_LOST &&
              static_cast<int>(Reason::out_of_memory) == v1::OUT_OF_MEMORY &&
              static_cast<int>(Reason::disk_full) == v1::DISK_FULL && static_cast<int>(Reason::wall_limit) == v1::WALL_LIMIT &&
              static_cast<int>(Reason::checkpoint_corrupt) == v1::CHECKPOINT_CORRUPT &&
              static_cast<int>(Reason::stale_epoch) == v1::STALE_EPOCH &&
              static_cast<int>(Reason::folder_removed) == v1::FOLDER_REMOVED &&
              static_cast<int>(Reason::internal) == v1::INTERNAL);

namespace {

std::optional<std::string> read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  return std::move(text).str();
}

// The first fault of a text, with its place.
class FirstFault : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int line, google::protobuf::io::ColumnNumber column, const std::string& message) override {
    if (text.empty()) text = "line " + std::to_string(line + 1) + ", column " + std::to_string(column + 1) + ": " + message;
  }
  std::string text;
};

std::optional<bool> one_writer(v1::CheckpointPolicy::Writers writers) {
  if (writers == v1::CheckpointPolicy::AUTOMATIC) return std::nullopt;
  return writers == v1::CheckpointPolicy::ONE_RANK;
}

}  // namespace

RunPolicy read_policy(const std::filesystem::path& folder) {
  v1::JobSpec spec;
  if (const auto text = read_text(folder / "job.txtpb")) {
    FirstFault fault;
    google::protobuf::TextFormat::Parser parser;
    parser.RecordErrorsTo(&fault);
    if (!parser.ParseFromString(*text, &spec)) throw Stop(Reason::invalid_case, "job.txtpb, " + fault.text);
  }
  const v1::CheckpointPolicy& checkpoints = spec.checkpoints();
  return {.checkpoint_steps = checkpoints.every_steps(),
          .checkpoint_simulated = checkpoints.every_simulated_seconds(),
          .checkpoint_wall = checkpoints.every_wall_seconds(),
          .keep = static_cast<int>(std::max(2u, checkpoints.keep())),
          .keep_every_nth = checkpoints.keep_every_nth(),
          .keep_every_simulated = checkpoints.keep_every_simulated_seconds(),
          .go_on_when_full = checkpoints.when_disk_full() == v1::CheckpointPolicy::GO_ON,
          .one_writer = one_writer(checkpoints.writers()),
          .wall_limit = spec.wall_limit_seconds()};
}

std::uint64_t checkpoints_since_kept(const std::filesystem::path& folder) {
  std::uint64_t count = 0;
  LogReader(folder / "events.log").read([&](const LogRecord& record) {
    v1::Event event;
    if (!event.ParseFromString(record.payload) || !event.has_checkpoint()) return;
    count = event.checkpoint().stays() ? 0 : count + 1;
  });
  return count;
}

// The two logs, and what waits for room on the disk: in order, events without their numbers yet.
struct JobFolder::Logs {
  LogWriter events, statistics;
  std::deque<std::variant<v1::Event, v1::StatisticsRecord>> waiting{};
  std::size_t waiting_bytes = 0;

  explicit Logs(const std::filesystem::path& folder) : events(folder / "events.log"), statistics(folder / "statistics.log") {}

  void write(v1::Event event) {
    event.set_sequence(events.next_sequence());
    events.append(static_cast<std::uint32_t>(event.what_case()), event.SerializeAsString());
  }
  void write(const v1::StatisticsRecord& record) { statistics.append(1, record.SerializeAsString()); }
  void write_waiting() {
    for (; !waiting.empty(); waiting.pop_front()) {
      std::visit([this](const auto& record) { write(record); }, waiting.front());
    }
    waiting_bytes = 0;
  }
  void keep(const v1::StatisticsRecord& record) {
    waiting_bytes += record.ByteSizeLong() + sizeof(record);
    waiting.emplace_back(record);
  }
  void keep(const v1::Event& event) {
    if (event.has_progress()) return;  // not worth the memory: the next is as good
    waiting_bytes += event.ByteSizeLong() + sizeof(event);
    waiting.emplace_back(event);
  }
};

JobFolder::JobFolder(const Comm& comm, std::filesystem::path folder, std::uint32_t epoch, bool go_on_when_full)
    : path_(std::move(folder)),
      epoch_(epoch),
      go_on_when_full_(go_on_when_full),
      heartbeat_(comm.root(), path_ / "heartbeat", epoch) {
  if (!comm.root()) return;
  try {
    logs_ = std::make_unique<Logs>(path_);
  } catch (const std::system_error& error) {
    failure_.note(error.code().value() == ENOSPC ? Reason::disk_full : Reason::internal, error.what());
    return;
  }
}
JobFolder::~JobFolder() = default;

namespace {

constexpr std::size_t most_waiting_bytes = 16 << 20;

bool is_full(const std::system_error& error) {
  return error.code().value() == ENOSPC || error.code().value() == EDQUOT;
}

}  // namespace

void JobFolder::note(const std::system_error& error) {
  if (is_full(error) && go_on_when_full_ && logs_->waiting_bytes <= most_waiting_bytes) return;
  failure_.note(is_full(error) ? Reason::disk_full : Reason::internal,
                "the job folder cannot be written: " + std::string(error.what()) +
                    "; make room on the disk, then resume the job: checkpoints are kept");
}

template <class Record>
void JobFolder::append(const Record& record) {
  if (!logs_) return;
  try {
    logs_->write_waiting();
    logs_->write(record);
  } catch (const std::system_error& error) {
    if (is_full(error)) logs_->keep(record);
    note(error);
  }
}

void JobFolder::append_event(v1::Event event) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  event.set_unix_nanos(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
  event.set_epoch(epoch_);
  append(event);
}

bool JobFolder::has_unwritten() const {
  return logs_ && !logs_->waiting.empty();
}

void JobFolder::leave() {
  logs_.reset();
  heartbeat_.leave();
}

bool JobFolder::is_removed() const {
  struct stat file {};
  return logs_ && stat((path_ / "events.log").c_str(), &file) != 0 && (errno == ENOENT || errno == ENOTDIR);
}

void JobFolder::started(int ranks, std::uint64_t step, double time, double end_time, const std::string& from_checkpoint,
                        const std::string& plan) {
  v1::Event event;
  v1::Started& started = *event.mutable_started();
  started.set_ranks(static_cast<std::uint32_t>(ranks));
  started.set_step(step);
  started.set_time(time);
  started.set_end_time(end_time);
  if (!from_checkpoint.empty()) started.set_from_checkpoint(from_checkpoint);
  started.set_plan(plan);
  started.set_version(BEDFLOW_VERSION);
  append_event(std::move(event));
}

void JobFolder::progress(const ProgressReport& now) {
  v1::Event event;
  v1::Progress& progress = *event.mutable_progress();
  progress.set_step(now.step);
  progress.set_time(now.time);
  progress.set_step_size(now.step_size);
  progress.set_end_time(now.end_time);
  progress.set_wall_seconds(now.wall_seconds);
  if (now.eta_seconds >= 0) progress.set_eta_seconds(now.eta_seconds);
  progress.set_substeps(now.substeps);
  progress.set_particles(now.particles);
  progress.set_gas_iterations(static_cast<std::uint32_t>(now.gas_iterations));
  progress.set_phase(now.phase);
  append_event(std::move(event));
}

void JobFolder::checkpoint(const CheckpointWrittenReport& report) {
  v1::Event event;
  v1::CheckpointWritten& written = *event.mutable_checkpoint();
  written.set_file(report.file);
  written.set_step(report.step);
  written.set_time(report.time);
  written.set_bytes(report.bytes);
  written.set_seconds(report.seconds);
  if (report.stays) written.set_stays(true);
  written.mutable_removed_steps()->Assign(report.removed.begin(), report.removed.end());
  append_event(std::move(event));
  sync();
}

void JobFolder::log_line(int severity, const std::string& text) {
  v1::Event event;
  event.mutable_log()->set_severity(static_cast<v1::LogLine::Severity>(severity));
  event.mutable_log()->set_text(text);
  append_event(std::move(event));
}
void JobFolder::info(const std::string& text) {
  log_line(v1::LogLine::INFO, text);
}
void JobFolder::warning(const std::string& text) {
  log_line(v1::LogLine::WARNING, text);
}
void JobFolder::error(const std::string& text) {
  log_line(v1::LogLine::ERROR, text);
}

void JobFolder::stopped(Reason reason, const std::string& message, std::uint64_t step, double time) {
  v1::Event event;
  v1::Stopped& stopped = *event.mutable_stopped();
  stopped.set_reason(static_cast<v1::StopReason>(reason));
  stopped.set_message(message);
  stopped.set_step(step);
  stopped.set_time(time);
  append_event(std::move(event));
  sync();
}

void JobFolder::statistics_schema(const std::vector<MonitorReport>& monitors) {
  v1::StatisticsRecord record;
  for (const MonitorReport& monitor : monitors) {
    v1::MonitorSchema& schema = *record.mutable_schema()->add_monitors();
    schema.set_name(monitor.name);
    schema.set_unit(monitor.unit);
    schema.set_meaning(monitor.meaning);
    schema.set_is_profile(monitor.profile);
    schema.mutable_places()->Assign(monitor.places.begin(), monitor.places.end());
    schema.set_averaging_start(monitor.averaging_start);
    schema.set_averaging_bin(monitor.averaging_bin);
    schema.set_averaging_bins(static_cast<std::uint32_t>(monitor.averaging_bins));
  }
  append(record);
}
void JobFolder::statistics_resumed(std::uint64_t step) {
  v1::StatisticsRecord record;
  record.mutable_resumed()->set_step(step);
  append(record);
}
void JobFolder::sample(std::size_t monitor, std::uint64_t step, double time, double value) {
  v1::StatisticsRecord record;
  v1::Sample& sample = *record.mutable_sample();
  sample.set_monitor(static_cast<std::uint32_t>(monitor));
  sample.set_step(step);
  sample.set_time(time);
  sample.set_value(value);
  append(record);
}
void JobFolder::bin(std::size_t monitor, int bin, std::uint64_t step, std::span<const double> mean,
                    std::span<const double> deviation) {
  v1::StatisticsRecord record;
  v1::BinClosed& closed = *record.mutable_bin();
  closed.set_monitor(static_cast<std::uint32_t>(monitor));
  closed.set_bin(static_cast<std::uint32_t>(bin));
  closed.set_step(step);
  closed.mutable_mean()->Assign(mean.begin(), mean.end());
  closed.mutable_deviation()->Assign(deviation.begin(), deviation.end());
  append(record);
}
void JobFolder::sync() {
  if (!logs_) return;
  try {
    logs_->write_waiting();
    logs_->events.sync();
    logs_->statistics.sync();
  } catch (const std::system_error& error) {
    note(error);
  }
}

Command JobFolder::poll() {
  const auto now = std::chrono::steady_clock::now();
  if (!logs_ || now - last_poll_ < std::chrono::milliseconds(100)) return Command::none;
  last_poll_ = now;
  heartbeat_.beat();
  // Taken by renaming, so that a command is obeyed once and a newer one is never lost.
  const std::filesystem::path taken = path_ / "control.obeyed.txtpb";
  std::error_code none;
  std::filesystem::rename(path_ / "control.txtpb", taken, none);
  if (none) return Command::none;
  const auto text = read_text(taken);
  v1::Control control;
  if (!text || !google::protobuf::TextFormat::ParseFromString(*text, &control)) {
    warning("control.txtpb is no Control message and was ignored");
    return Command::none;
  }
  switch (control.command()) {
    case v1::Control::CHECKPOINT:
      return Command::checkpoint;
    case v1::Control::SUSPEND:
      return Command::suspend;
    case v1::Control::CANCEL:
      return control.skip_checkpoint() ? Command::cancel_now : Command::cancel;
    case v1::Control::LIMIT:
      return Command::limit;
    default:
      return Command::none;
  }
}

}  // namespace bedflow
