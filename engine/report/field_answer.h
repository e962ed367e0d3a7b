// Questions about a checkpoint and their answers as messages (fields.proto).
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace bedflow {

// FieldAnswer messages, serialized, one after the other: the header, then values in parts of at most half a MiB. query:
// FieldQuery in text format. Throws FieldRefusal for a question that makes no sense, Stop(checkpoint_corrupt) for a file that is
// not good.
void answer_field(const std::filesystem::path& checkpoint, const std::string& query,
                  const std::function<void(const std::string&)>& send);

// A CheckpointReport, serialized. Its arrays are named, not verified.
std::string describe_checkpoint(const std::filesystem::path& checkpoint);

}  // namespace bedflow
