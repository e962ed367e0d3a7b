// Checkpoint files between here and the server: parts with checksums, taken up where they stopped.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "connection.h"

namespace bedflow::client {

struct TransferCalls {
  std::function<void(std::uint64_t done, std::uint64_t all)> progress = [](std::uint64_t, std::uint64_t) {};
  std::function<void(const std::string&)> note = [](const std::string&) {};
};

// Writes FILE.part, and FILE.part.seal that names what it is a part of; FILE when it is whole. What an earlier try left is gone
// on with, unless the checkpoint is another now. file: empty for the server's name of it. Tries again for so many seconds while
// the server is away. Returns the file. Throws Failure.
std::filesystem::path download_checkpoint(const Connection& connection, const v1::CheckpointName& name,
                                          const std::filesystem::path& file, double away_seconds, const TransferCalls& calls);

// The suspended job that the server makes of a file. Throws Failure.
v1::Job import_checkpoint(const Connection& connection, const std::filesystem::path& file,
                          const v1::ImportCheckpointRequest::Head& head, const TransferCalls& calls);

}  // namespace bedflow::client
