// Programs that the client starts: found beside its own executable or on the path, never through a shell.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace bedflow::client {

std::filesystem::path beside_own_executable(const std::string& name);  // throws Failure if it is not there

struct ChildResult {
  int exit_code = 0;  // 128 + signal if one ended it
  std::string out;
  std::string error;
};

// Writes `input` to the child's stdin, gathers stdout and stderr. `program` without a slash is looked up on PATH.
// Throws std::system_error, ENOENT if there is no such program.
ChildResult run_child(const std::vector<std::string>& command, const std::string& input = {});

// Starts a child in its own session with stdin empty and both outputs appended to a file. Returns its pid; throws
// std::system_error.
pid_t start_detached(const std::vector<std::string>& command, const std::filesystem::path& log);

}  // namespace bedflow::client
