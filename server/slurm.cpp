#include "slurm.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

namespace bedflow::server {
namespace {

// One word of the shell, whatever is in it.
std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

bool is_one_of(const std::string& word, std::initializer_list<const char*> list) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

}  // namespace

std::vector<std::string> queue_command() {
  return {"squeue", "--noheader", "--states=all", "--user=" + std::to_string(::getuid()), "--format=%i|%T|%r|%B|%j"};
}

std::vector<SlurmJob> parse_queue(const std::string& text) {
  std::vector<SlurmJob> jobs;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    SlurmJob job;
    for (auto* field : {&job.id, &job.state, &job.reason, &job.node}) std::getline(fields, *field, '|');
    std::getline(fields, job.name);
    if (job.node == "n/a") job.node.clear();
    if (!job.name.empty()) jobs.push_back(std::move(job));
  }
  return jobs;
}

SlurmStage stage_of(const std::string& state) {
  if (is_one_of(state, {"PENDING", "CONFIGURING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED", "RESV_DEL_HOLD", "SPECIAL_EXIT"}))
    return SlurmStage::queued;
  if (is_one_of(state, {"RUNNING", "RESIZING", "SIGNALING", "STAGE_OUT", "STOPPED", "SUSPENDED"})) return SlurmStage::runs;
  return state == "COMPLETING" ? SlurmStage::completing : SlurmStage::ended;
}

std::optional<Ending> ending_of(const SlurmJob& job) {
  const std::string text = "Slurm's job " + job.id + " ended as " + job.state + (job.node.empty() ? "" : " on " + job.node);
  if (is_one_of(job.state, {"NODE_FAIL", "BOOT_FAIL", "PREEMPTED"})) return Ending{v1::NODE_LOST, text};
  if (is_one_of(job.state, {"TIMEOUT", "DEADLINE"}))
    return Ending{v1::WALL_LIMIT, text + " before a checkpoint was written; resume the job with a longer limit"};
  if (job.state == "OUT_OF_MEMORY") return Ending{v1::OUT_OF_MEMORY, text};
  if (job.state == "CANCELLED")
    return Ending{v1::SUSPENDED, text + ", not by this server; resume the job to go on from its newest checkpoint"};
  return std::nullopt;
}

std::string batch_name(const std::string& server_id, const JobFolder& folder, std::uint32_t epoch) {
  return "bedflow-" + server_id + "-" + folder.root().filename().string() + "-" + std::to_string(epoch);
}

std::chrono::seconds warning_time(const AttemptOrder& order) {
  constexpr double slow_disk = 20e6;  // bytes/s: many writers on a shared file system; what is written is read back
  constexpr double least = 60, most = 65535;
  double seconds = std::clamp(30 + 3 * order.step_time.count() + 2 * order.checkpoint_bytes / slow_disk, least, most);
  if (order.wall_limit.count() > 0) seconds = std::min(seconds, order.wall_limit.count() / 2);
  return std::chrono::seconds(static_cast<std::int64_t>(std::ceil(seconds)));
}

std::string batch_script(const SlurmSettings& settings, const Programs& programs, const JobFolder& folder,
                         const AttemptOrder& order) {
  std::string text = "#!/bin/sh\n# attempt " + std::to_string(order.epoch) + " at " + folder.root().filename().string() + "\n";
  if (!settings.prologue.empty()) text += read_text(settings.prologue) + "\n";
  text += "exec " + quoted(programs.server) + " run-attempt " + quoted(folder.root()) + " " + std::to_string(order.epoch) +
          " --engine " + quoted(programs.engine) + " --ranks " + std::to_string(order.ranks) + " --launcher " +
          quoted(settings.launcher) + " --batch-job \"$SLURM_JOB_ID\"";
  if (order.from_step) text += " --from " + std::to_string(*order.from_step);
  return text + "\n";
}

std::vector<std::string> submit_command(const SlurmSettings& settings, const std::string& name, const JobFolder& folder,
                                        const AttemptOrder& order) {
  std::vector<std::string> command = {"sbatch",
                                      "--parsable",
                                      "--job-name=" + name,
                                      "--ntasks=" + std::to_string(order.ranks),
                                      "--chdir=" + folder.root().string(),
                                      "--output=" + folder.output_log(order.epoch).string(),
                                      "--error=" + folder.error_log(order.epoch).string(),
                                      "--open-mode=append",
                                      "--no-requeue"};  // the server does that, from the newest good checkpoint
  auto before_end = warning_time(order).count();
  if (const double limit = order.wall_limit.count(); limit > 0) {
    const auto minutes = static_cast<std::int64_t>(std::ceil(limit / 60));  // Slurm counts in whole minutes
    command.push_back("--time=" + std::to_string(minutes));
    before_end += minutes * 60 - static_cast<std::int64_t>(limit);
  }
  command.push_back("--signal=B:USR1@" + std::to_string(std::min<std::int64_t>(before_end, 65535)));
  if (settings.asks_for_memory && order.memory_bytes > 0) {
    constexpr double margin = 1.25;  // the plan is an estimate
    const auto mib = static_cast<std::int64_t>(std::ceil(margin * order.memory_bytes / order.ranks / (1 << 20)));
    command.push_back("--mem-per-cpu=" + std::to_string(mib) + "M");
  }
  command.insert(command.end(), settings.options.begin(), settings.options.end());
  command.push_back(folder.batch_script(order.epoch));
  return command;
}

bool is_passing(const std::string& said) {
  constexpr std::array passing = {"Unable to contact",           "Socket timed out",   "Connection refused",
                                  "Zero Bytes were transmitted", "temporarily",        "Connection timed out",
                                  "backup controller",           "Transport endpoint", "Unable to establish"};
  return std::any_of(passing.begin(), passing.end(), [&](const char* words) { return said.find(words) != std::string::npos; });
}

}  // namespace bedflow::server
