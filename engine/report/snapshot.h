// What a picture of the bed needs of a checkpoint, as the service's message.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace bedflow {

// Snapshot, serialized. most: every n-th particle where there are more; 0: all. Throws Stop(checkpoint_corrupt).
std::string snapshot_of(const std::filesystem::path& checkpoint, std::uint32_t most);

}  // namespace bedflow
