// `bedflowd backup --data DATA --to FOLDER`: a copy of a server's data folder from which a server can go on, made while it runs
// or not. What is in the folder already and has not changed is not copied again.
#pragma once

#include <cstdint>
#include <filesystem>

namespace bedflow::server {

struct BackupReport {
  std::uint64_t jobs = 0, files = 0, bytes = 0;  // files and bytes that were copied
};

// The catalogue first: a folder that is newer than it is taken up as one whose engine has died. Throws std::exception.
BackupReport back_up(const std::filesystem::path& data, const std::filesystem::path& to);

}  // namespace bedflow::server
