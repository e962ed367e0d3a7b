// Small files that are replaced as a whole: what is read is the old one or the new one, whatever happens. Made for their owner
// alone (mode 0600). All throw std::system_error.
#pragma once

#include <google/protobuf/message.h>

#include <filesystem>
#include <string_view>

namespace bedflow {

// Writes beside (….new), fsyncs, renames, fsyncs the folder.
void write_durably(const std::filesystem::path& path, std::string_view content);
void write_durably(const std::filesystem::path& path, const google::protobuf::Message& message);  // text format
// Room on the disk for one coming write_durably of at most 4096 bytes there.
void reserve(const std::filesystem::path& path);
void sync_folder(const std::filesystem::path& folder);

}  // namespace bedflow
