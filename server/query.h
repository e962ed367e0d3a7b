// Answers from a job's folder, whether it runs or not. HDF5 is read by a short-lived process of the engine, never here.
#pragma once

#include <filesystem>

#include "bedflow/v1/service.pb.h"
#include "folder.h"

namespace bedflow::server {

// Newest first. The time is that of the event that reported the checkpoint.
v1::ListCheckpointsResponse list_checkpoints(const JobFolder& folder, const std::string& id);

// Throws Refusal: series_not_found with the names there are, bad_request, log_damaged.
v1::Statistics query_statistics(const JobFolder& folder, const v1::QueryStatisticsRequest& request);

// Of the checkpoint named, or of the newest that is good. Throws Refusal: checkpoint_not_found, checkpoint_corrupt,
// backend_error.
v1::Snapshot snapshot(const std::filesystem::path& engine, const JobFolder& folder, const v1::GetSnapshotRequest& request);

}  // namespace bedflow::server
