// A checkpoint from outside made into one of ours.
//
// Checksums keep out accidents, not malice: whoever made the file made them too. So nothing of it is passed on as it is. Each
// array is checked against the case that the file carries, and a new file is written from their values: the metadata that an
// engine reads later is all our own.
#pragma once

#include <filesystem>

namespace bedflow {

// Writes folder/case.txtpb and folder/checkpoints/checkpoint_<step>.h5. Throws Stop: checkpoint_corrupt with what is wrong with
// the file, invalid_case with what is wrong with its case or does not fit it, disk_full. For one rank alone.
void import_checkpoint(const std::filesystem::path& file, const std::filesystem::path& folder);

}  // namespace bedflow
