// What a job has yielded, from the server or straight from its folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bedflow/v1/results.pb.h"
#include "connection.h"
#include "statistics_file.h"

namespace bedflow::client {

class Results {
 public:
  // `job` is a job folder (a folder with a case.txtpb in it) or the id of a job on the server. Throws Failure.
  Results(const std::string& job, const ServerChoice& server);

  v1::Statistics statistics(const StatisticsQuery& query) const;
  std::vector<v1::SeriesInfo> series() const;  // and profiles
  std::optional<v1::Case> effective_case() const;
  // From the newest checkpoint that is good, or the one of a step; at most so many particles.
  v1::Snapshot snapshot(std::optional<std::uint64_t> step, std::uint32_t most) const;
  std::string name() const;  // the id, or the folder's name

 private:
  v1::Snapshot snapshot_from_file(const std::filesystem::path& checkpoint, std::uint32_t most) const;

  std::filesystem::path folder_;  // empty: ask the server
  std::string id_;
  ServerChoice server_;
};

// Of a job folder, newest first; of a step if one is named.
std::vector<std::filesystem::path> checkpoints_of(const std::filesystem::path& folder, std::optional<std::uint64_t> step);

bool is_job_folder(const std::filesystem::path& path);

}  // namespace bedflow::client
