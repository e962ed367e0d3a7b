// Slurm by its commands: what is asked of it, and what its answers mean. See slurm_executor.h for when.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "executor.h"

namespace bedflow::server {

struct SlurmSettings {
  std::vector<std::string> options;      // of sbatch, the site's: partition, account, …
  std::string launcher = "mpirun";       // in an attempt of more than one rank: words, followed by -n RANKS ENGINE …
  std::filesystem::path prologue;        // shell lines that go before the runner in the batch script; none if empty
  std::uint32_t most_ranks = 1024;       // of one job
  bool asks_for_memory = false;          // --mem-per-cpu by the plan
  std::chrono::milliseconds poll{2000};  // between two looks at Slurm's queue while attempts are there
};

// One line of squeue.
struct SlurmJob {
  std::string id, state, reason, node, name;
};
std::vector<SlurmJob> parse_queue(const std::string& text);
std::vector<std::string> queue_command();  // of this user, ended jobs too as long as Slurm remembers them

// What Slurm's word for a state means for the attempt.
enum class SlurmStage { ended, completing, queued, runs };  // the later says more about the attempt, should two have its name
SlurmStage stage_of(const std::string& state);
// How an attempt ended that has left no exit record; nothing where the state does not tell.
std::optional<Ending> ending_of(const SlurmJob& job);

// bedflow-<server>-<job>-<epoch>: what a job is found by when the answer to its submission was lost.
std::string batch_name(const std::string& server_id, const JobFolder& folder, std::uint32_t epoch);

// The seconds before the wall limit at which Slurm is to send the signal: enough for a step and a checkpoint.
std::chrono::seconds warning_time(const AttemptOrder& order);
std::string batch_script(const SlurmSettings& settings, const Programs& programs, const JobFolder& folder,
                         const AttemptOrder& order);
std::vector<std::string> submit_command(const SlurmSettings& settings, const std::string& name, const JobFolder& folder,
                                        const AttemptOrder& order);

// Whether the same submission may do better later: the controller does not answer, or too much is asked of it.
bool is_passing(const std::string& said);

}  // namespace bedflow::server
