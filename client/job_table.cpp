#include "job_table.h"

#include <array>

#include "failure.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

std::string progress_text(const v1::Job& job) {
  if (!job.has_progress() || job.progress().end_time() <= 0) return "-";
  std::array<char, 16> percent{};
  std::snprintf(percent.data(), percent.size(), "%.1f %%", 100 * job.progress().time() / job.progress().end_time());
  return percent.data();
}

Cell eta_cell(const v1::Job& job) {
  if (is_final(job.state()) || !job.progress().has_eta_seconds()) return {};
  return duration_text(job.progress().eta_seconds());
}

std::string state_text(const v1::Job& job) {
  return state_name(job.state()) + (job.state() == v1::FAILED ? " " + reason_name(job.reason()) : "");
}

}  // namespace

Table table_of(const std::vector<v1::Job>& jobs) {
  Table table({"id", "case", "state", "progress", "time_s", "eta", "ranks", "created"});
  for (const auto& job : jobs) {
    table.add({job.id(), job.case_name(), state_text(job), progress_text(job),
               job.has_progress() ? Cell(job.progress().time()) : Cell(), eta_cell(job), std::uint64_t{job.spec().ranks()},
               time_text(job.created_unix_nanos())});
  }
  return table;
}

Table table_of(const v1::Job& job) {
  Table table({"property", "value"});
  table.add({"id", job.id()});
  table.add({"case", job.case_name()});
  table.add({"state", state_text(job)});
  if (job.has_owner()) table.add({"owner", job.owner()});
  if (!job.message().empty()) table.add({"message", job.message()});
  if (!job.waits_for().empty()) table.add({"waits for", job.waits_for()});
  table.add({"progress", progress_text(job)});
  if (job.has_progress()) {
    table.add({"time", number_text(job.progress().time()) + " of " + number_text(job.progress().end_time()) + " s"});
    table.add({"step", std::to_string(job.progress().step())});
    table.add({"particles", std::to_string(job.progress().particles())});
  }
  if (const auto eta = eta_cell(job); eta != Cell()) table.add({"eta", eta});
  table.add({"ranks", std::to_string(job.spec().ranks())});
  if (job.spec().executor() != "local") table.add({"executor", job.spec().executor()});
  if (!job.batch_job().empty()) table.add({"Slurm's job", job.batch_job() + (job.node().empty() ? "" : " on " + job.node())});
  if (job.spec().priority() != 0) table.add({"priority", std::to_string(job.spec().priority())});
  if (job.spec().wall_limit_seconds() > 0) {
    table.add({"wall limit",
               duration_text(job.spec().wall_limit_seconds()) +
                   (job.spec().at_wall_limit() == v1::JobSpec::REQUEUE ? ", then it goes on when its turn comes again" : "")});
  }
  if (job.planned_memory_bytes() > 0) table.add({"planned memory", bytes_text(job.planned_memory_bytes())});
  table.add({"attempts", std::to_string(job.epoch())});
  table.add({"created", time_text(job.created_unix_nanos())});
  table.add({"changed", time_text(job.changed_unix_nanos())});
  table.add({"last event", std::to_string(job.last_sequence())});
  if (job.has_start_from_job())
    table.add({"started from", job.start_from_job() + ", step " + std::to_string(job.start_from_step()) +
                                   (job.packing_only() ? ", its particles alone" : "")});
  for (const auto& one : job.overrides()) table.add({"changed " + one.path(), one.from() + " -> " + one.to()});
  if (job.has_memory_bytes()) table.add({"memory", bytes_text(job.memory_bytes())});
  if (job.has_rank_seconds()) table.add({"ranks x time", duration_text(job.rank_seconds())});
  if (job.pinned()) table.add({"pinned", "yes"});
  for (const auto step : job.pinned_steps()) table.add({"pinned checkpoint", std::to_string(step)});
  for (const auto& [name, value] : job.spec().labels()) table.add({"label " + name, value});
  if (!job.folder().empty()) table.add({"folder", job.folder()});
  return table;
}

Table table_of(const std::vector<v1::Checkpoint>& checkpoints) {
  Table table({"step", "time_s", "bytes", "stays", "file"});
  for (const auto& one : checkpoints) {
    const std::string stays = one.pinned() ? "pinned" : one.stays() ? "by policy" : "";
    table.add({one.step(), one.time(), one.bytes(), stays.empty() ? Cell() : Cell(stays), one.file()});
  }
  return table;
}

}  // namespace bedflow::client
