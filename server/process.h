// Child processes: started detached, or asked a question with a time limit; and who belongs to a session.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace bedflow::server {

struct Launch {
  std::vector<std::string> command;         // the program is looked for on PATH
  std::vector<std::string> environment;     // NAME=value, in addition to ours
  int input = -1, output = -1, error = -1;  // descriptors; /dev/null if absent
  int kept = -1;                            // a descriptor that the child has as number 3
  bool new_session = false;
};

// Signal mask and handlers are reset in the child. Throws std::system_error when it cannot be started.
pid_t launch(const Launch& what);

struct Answer {
  int exit_code = -1;  // 128 + signal when killed
  bool timed_out = false;
  std::string output;
  std::string error;
};

// Runs a command to its end; kills it after `limit` or when it says more than `most_bytes`.
Answer ask(const std::vector<std::string>& command, std::chrono::milliseconds limit, std::size_t most_bytes);

// A child whose output is read as it comes. Killed with its owner.
class Child {
 public:
  using Deadline = std::chrono::steady_clock::time_point;
  explicit Child(const std::vector<std::string>& command);  // throws std::system_error
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // So many bytes of its output; fewer when it ends before or the time is over.
  std::string read(std::size_t bytes, Deadline deadline);
  // After its output: waits for its end, kills it when the time is over. error: what it said there, at most 4 KiB.
  Answer end(Deadline deadline);

 private:
  pid_t pid_ = -1;
  int output_ = -1, error_ = -1;
};

int wait_for_exit(pid_t child);  // exit code, or 128 + signal

// Field 22 of /proc/<pid>/stat; nothing when there is no such process or it is a zombie.
std::optional<std::uint64_t> start_ticks(pid_t process);
std::string command_line(pid_t process);            // each word ends with a zero byte; empty when there is no such process
std::vector<pid_t> session_members(pid_t session);  // zombies left out
std::string host_name();                            // of this machine

}  // namespace bedflow::server
