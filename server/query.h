// Answers from a job's folder, whether it runs or not. HDF5 is read by a short-lived process of the engine, never here.
#pragma once

#include <filesystem>

#include "bedflow/v1/service.pb.h"
#include "folder.h"
#include "reader.h"

namespace bedflow::server {

// Newest first. The time is that of the event that reported the checkpoint.
v1::ListCheckpointsResponse list_checkpoints(const JobFolder& folder, const std::string& id);

// With what it holds. Throws Refusal: checkpoint_not_found, checkpoint_corrupt and what Readers throw.
v1::Checkpoint get_checkpoint(Readers& readers, const JobFolder& folder, const v1::CheckpointName& name);

// Of the checkpoint that is named, or the newest, good or not. Throws Refusal: checkpoint_not_found, and what Readers throw.
v1::VerifyCheckpointResponse verify_checkpoint(Readers& readers, const JobFolder& folder, const v1::CheckpointName& name);

// Of the checkpoint named, or of the newest that is good. Throws Refusal: checkpoint_not_found, checkpoint_corrupt,
// backend_error.
v1::Snapshot snapshot(const std::filesystem::path& engine, const JobFolder& folder, const v1::GetSnapshotRequest& request);

}  // namespace bedflow::server
