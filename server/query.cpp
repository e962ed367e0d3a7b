#include "query.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <string>
#include <system_error>

#include "follow.h"
#include "process.h"
#include "record_log.h"
#include "refusal.h"
#include "security.h"

namespace bedflow::server {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t most_particles_sent = 200'000;  // 16 bytes each: below gRPC's default of 4 MiB an answer

Answer ask_for_snapshot(const std::filesystem::path& engine, const std::filesystem::path& file, std::uint32_t most) {
  return ask({engine, "--snapshot", file, "--most", std::to_string(most)}, 60s, 256 << 20);
}

}  // namespace

v1::ListCheckpointsResponse list_checkpoints(const JobFolder& folder, const std::string& id) {
  std::map<std::uint64_t, double> times;
  LogReader(folder.events()).read([&](const LogRecord& record) {
    const auto event = event_of(record);
    if (event.has_checkpoint()) times[event.checkpoint().step()] = event.checkpoint().time();
    if (event.has_started()) times[event.started().step()] = event.started().time();
  });
  v1::ListCheckpointsResponse response;
  for (const auto step : folder.checkpoint_steps()) {
    std::error_code gone;
    const auto bytes = std::filesystem::file_size(folder.checkpoint(step), gone);
    if (gone) continue;  // the engine keeps only the newest ones
    auto& checkpoint = *response.add_checkpoints();
    checkpoint.set_job(id);
    checkpoint.set_step(step);
    checkpoint.set_bytes(bytes);
    checkpoint.set_file(JobFolder::checkpoint_name(step));
    if (std::filesystem::exists(folder.pin(step), gone)) checkpoint.set_pinned(true);
    if (std::filesystem::exists(folder.kept_mark(step), gone)) checkpoint.set_stays(true);
    if (const auto time = times.find(step); time != times.end()) checkpoint.set_time(time->second);
  }
  return response;
}

v1::Checkpoint get_checkpoint(Readers& readers, const JobFolder& folder, const v1::CheckpointName& name) {
  v1::Checkpoint checkpoint;
  with_checkpoint(folder, name, [&](std::uint64_t step, const std::filesystem::path& file) {
    auto& content = *checkpoint.mutable_content() = readers.describe(file);
    checkpoint.set_job(name.job());
    checkpoint.set_step(step);
    checkpoint.set_time(content.time());
    checkpoint.set_bytes(content.bytes());
    checkpoint.set_file(JobFolder::checkpoint_name(step));
  });
  return checkpoint;
}

v1::VerifyCheckpointResponse verify_checkpoint(Readers& readers, const JobFolder& folder, const v1::CheckpointName& name) {
  v1::VerifyCheckpointResponse response;
  with_checkpoint(folder, name, [&](std::uint64_t step, const std::filesystem::path& file) {
    response.set_job(name.job());
    response.set_step(step);
    response.set_bytes(std::filesystem::file_size(file));
    for (auto& fault : readers.verify(file)) *response.add_faults() = std::move(fault);
    response.set_good(response.faults().empty());
  });
  return response;
}

v1::Snapshot snapshot(const std::filesystem::path& engine, const JobFolder& folder, const v1::GetSnapshotRequest& request) {
  auto steps = folder.checkpoint_steps();
  if (request.has_step()) std::erase_if(steps, [&](std::uint64_t step) { return step != request.step(); });
  const std::string list = "bedflow checkpoint list " + request.id();
  if (steps.empty()) {
    throw Refusal(
        Refused::checkpoint_not_found,
        "job " + request.id() + " has no checkpoint" + (request.has_step() ? " of step " + std::to_string(request.step()) : ""),
        list);
  }
  const auto most = request.most_particles() == 0 ? most_particles_sent : std::min(request.most_particles(), most_particles_sent);
  std::string faults;
  for (const auto step : steps) {
    const Answer answer = ask_for_snapshot(engine, folder.checkpoint(step), most);
    v1::Snapshot found;
    if (answer.exit_code == 0 && found.ParseFromString(answer.output)) return found;
    if (answer.exit_code != v1::CHECKPOINT_CORRUPT && std::filesystem::exists(folder.checkpoint(step))) {
      throw Refusal(Refused::backend_error, answer.timed_out ? "the engine gave no snapshot within 60 s"
                                                             : "the engine gave no snapshot: " + printable(answer.error));
    }
    faults += (faults.empty() ? "" : "; ") + JobFolder::checkpoint_name(step) + ": " + printable(answer.error);
  }
  throw Refusal(Refused::checkpoint_corrupt, "no good checkpoint: " + faults, list);
}

}  // namespace bedflow::server
