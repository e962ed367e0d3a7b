#include "results.h"

#include <algorithm>
#include <stdexcept>

#include "case_file.h"
#include "child.h"
#include "terminal.h"

namespace bedflow::client {

std::vector<std::filesystem::path> checkpoints_of(const std::filesystem::path& folder, std::optional<std::uint64_t> step) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "checkpoints", error)) {
    const auto name = entry.path().filename().string();
    if (!name.starts_with("checkpoint_") || !name.ends_with(".h5")) continue;
    const auto digits = name.substr(11, name.size() - 14);
    if (digits.empty() || digits.find_first_not_of("0123456789") != digits.npos) continue;
    if (!step || std::stoull(digits) == *step) files.push_back(entry.path());
  }
  std::sort(files.rbegin(), files.rend());
  return files;
}

bool is_job_folder(const std::filesystem::path& path) {
  return std::filesystem::exists(path / "case.txtpb");
}

Results::Results(const std::string& job, const ServerChoice& server) : server_(server) {
  if (is_job_folder(job)) {
    folder_ = std::filesystem::canonical(job);
  } else if (job.find('/') != job.npos || std::filesystem::is_directory(job)) {
    throw Failure(Exit::not_found, "\"" + job + "\" is not a job folder: it has no case.txtpb",
                  "the jobs of the server: bedflow list");
  } else {
    id_ = job;
  }
}

v1::Statistics Results::statistics(const StatisticsQuery& query) const {
  if (!folder_.empty()) {
    const auto log = folder_ / "statistics.log";
    if (!std::filesystem::exists(log)) {
      throw Failure(Exit::not_found, "the job folder " + folder_.string() + " has no statistics yet",
                    "its events: bedflow logs " + folder_.string());
    }
    try {
      return read_statistics(log, query);
    } catch (const std::out_of_range& error) {
      throw Failure(Exit::not_found, error.what());
    } catch (const std::runtime_error& error) {
      throw Failure(Exit::corrupt, error.what());
    }
  }
  v1::QueryStatisticsRequest request;
  request.set_id(id_);
  for (const auto& name : query.names) request.add_names(name);
  if (query.from_time) request.set_from_time(*query.from_time);
  if (query.to_time) request.set_to_time(*query.to_time);
  if (query.from_step) request.set_from_step(*query.from_step);
  if (query.to_step) request.set_to_step(*query.to_step);
  if (query.most > 0) request.set_most(query.most);
  return Connection(server_).call(&Stub::QueryStatistics, request, 60);
}

std::vector<v1::SeriesInfo> Results::series() const {
  if (!folder_.empty()) {
    try {
      StatisticsLog log(folder_ / "statistics.log");
      log.update();
      return log.series();
    } catch (const std::runtime_error& error) {
      throw Failure(Exit::corrupt, error.what());
    }
  }
  v1::ListSeriesRequest request;
  request.set_id(id_);
  const auto response = Connection(server_).call(&Stub::ListSeries, request, 60);
  return {response.series().begin(), response.series().end()};
}

std::optional<v1::Case> Results::effective_case() const {
  if (!folder_.empty()) {
    auto read = read_case_file(folder_ / "case.txtpb");
    if (!read.faults.empty()) say("the job's case.txtpb has faults; references and units of the case may be missing");
    return read.value;
  }
  auto job = Connection(server_).get_job(id_, true);
  if (!job.has_case_()) return std::nullopt;
  return job.case_();
}

v1::Snapshot Results::snapshot(std::optional<std::uint64_t> step, std::uint32_t most) const {
  if (folder_.empty()) {
    v1::GetSnapshotRequest request;
    request.set_id(id_);
    if (step) request.set_step(*step);
    request.set_most_particles(most);
    return Connection(server_).call(&Stub::GetSnapshot, request, 120);
  }
  const auto files = checkpoints_of(folder_, step);
  if (files.empty()) {
    const std::string which = step ? "of step " + std::to_string(*step) : "yet";
    throw Failure(Exit::not_found, "the job folder " + folder_.string() + " has no checkpoint " + which,
                  "one is written when the job is suspended or ends, and by its checkpoint policy");
  }
  for (std::size_t i = 0; i + 1 < files.size(); ++i) {
    try {
      return snapshot_from_file(files[i], most);
    } catch (const Failure& failure) {
      if (failure.code != Exit::corrupt) throw;
      say(std::string(failure.what()) + "; taking the one before");
    }
  }
  return snapshot_from_file(files.back(), most);
}

// Checkpoints are read by the engine: the client knows no HDF5.
v1::Snapshot Results::snapshot_from_file(const std::filesystem::path& checkpoint, std::uint32_t most) const {
  const auto engine = beside_own_executable("bedflow-engine");
  const auto result = run_child({engine.string(), "--snapshot", checkpoint.string(), "--most", std::to_string(most)});
  v1::Snapshot snapshot;
  if (result.exit_code == 0 && snapshot.ParseFromString(result.out)) return snapshot;
  const bool corrupt = result.exit_code == v1::CHECKPOINT_CORRUPT;
  const auto told = result.error.substr(0, result.error.find_last_not_of('\n') + 1);
  throw Failure(corrupt ? Exit::corrupt : Exit::other,
                "the checkpoint " + checkpoint.string() + " cannot be read" +
                    (told.empty() ? ", exit code " + std::to_string(result.exit_code) : ": " + told));
}

std::string Results::name() const {
  return folder_.empty() ? id_ : folder_.filename().string();
}

}  // namespace bedflow::client
