// A picture of the bed from one checkpoint: particles coloured by speed in front view, and the gas fraction averaged over the
// depth.
#pragma once

#include <filesystem>
#include <string>

#include "bedflow/v1/results.pb.h"

namespace bedflow::client {

// Axes are drawn to one scale. A part that the snapshot does not have is left out; throws Failure if it has neither.
std::string render_script(const v1::Snapshot& snapshot, const std::string& job, const std::filesystem::path& file);

}  // namespace bedflow::client
