#include "process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>
#include <utility>

namespace bedflow::server {
namespace {

using Clock = std::chrono::steady_clock;

[[noreturn]] void fail(int error, const std::string& doing) {
  throw std::system_error(error, std::generic_category(), doing);
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> list;
  list.reserve(texts.size() + 1);
  for (auto& text : texts) list.push_back(text.data());
  list.push_back(nullptr);
  return list;
}

class Pipe {
 public:
  Pipe() {
    if (::pipe2(ends_.data(), O_CLOEXEC) != 0) fail(errno, "pipe");
  }
  ~Pipe() {
    close_writer();
    if (ends_[0] >= 0) ::close(ends_[0]);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  int reader() const { return ends_[0]; }
  int release_reader() { return std::exchange(ends_[0], -1); }
  int writer() const { return ends_[1]; }
  void close_writer() {
    if (ends_[1] >= 0) ::close(ends_[1]);
    ends_[1] = -1;
  }

 private:
  std::array<int, 2> ends_{};
};

// False at the pipe's end.
bool take_from(int pipe, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t got = ::read(pipe, buffer.data(), buffer.size());
  if (got > 0) text.append(buffer.data(), static_cast<std::size_t>(got));
  return got > 0 || (got < 0 && errno == EINTR);
}

bool has_ended_by(pid_t child, Clock::time_point deadline) {
  pollfd end{static_cast<int>(::syscall(SYS_pidfd_open, child, 0)), POLLIN, 0};
  if (end.fd < 0) return false;
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
  const bool ended = ::poll(&end, 1, static_cast<int>(std::max<std::int64_t>(left, 0))) > 0;
  ::close(end.fd);
  return ended;
}

// A file of /proc/<pid>; empty when the process is gone, also when it goes between the opening and the reading.
std::string process_file(pid_t process, const std::string& name) {
  std::ostringstream text;
  text << std::ifstream("/proc/" + std::to_string(process) + "/" + name).rdbuf();
  return text.str();
}

// Fields of /proc/<pid>/stat from the third on: the second, the name, may hold anything.
std::vector<std::string> stat_fields(pid_t process) {
  const std::string text = process_file(process, "stat");
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return {};
  std::istringstream rest(text.substr(name_end + 1));
  return {std::istream_iterator<std::string>(rest), {}};
}

}  // namespace

pid_t launch(const Launch& what) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (const auto& [from, to] : {std::pair{what.input, 0}, std::pair{what.output, 1}, std::pair{what.error, 2}}) {
    if (from >= 0) {
      posix_spawn_file_actions_adddup2(&files, from, to);
    } else {
      posix_spawn_file_actions_addopen(&files, to, "/dev/null", to == 0 ? O_RDONLY : O_WRONLY, 0);
    }
  }
  if (what.kept >= 0) posix_spawn_file_actions_adddup2(&files, what.kept, 3);

  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  const int session = what.new_session ? POSIX_SPAWN_SETSID : 0;
  posix_spawnattr_setflags(&attributes, static_cast<short>(POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | session));

  auto command = what.command;
  std::vector<std::string> environment = what.environment;
  for (char** variable = environ; *variable; ++variable) environment.emplace_back(*variable);
  pid_t child = -1;
  const int error =
      posix_spawnp(&child, command.front().c_str(), &files, &attributes, pointers(command).data(), pointers(environment).data());
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) fail(error, "starting " + what.command.front());
  return child;
}

int wait_for_exit(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return -1;
  }
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

Answer ask(const std::vector<std::string>& command, std::chrono::milliseconds limit, std::size_t most_bytes) {
  Pipe output, error;
  const pid_t child = launch({.command = command, .environment = {}, .output = output.writer(), .error = error.writer()});
  output.close_writer();
  error.close_writer();
  Answer answer;
  const auto deadline = Clock::now() + limit;
  std::array<pollfd, 2> pipes{{{output.reader(), POLLIN, 0}, {error.reader(), POLLIN, 0}}};
  while (pipes[0].fd >= 0 || pipes[1].fd >= 0) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0 || answer.output.size() + answer.error.size() > most_bytes) break;
    if (::poll(pipes.data(), pipes.size(), static_cast<int>(left)) < 0 && errno != EINTR) break;
    if (pipes[0].revents != 0 && !take_from(pipes[0].fd, answer.output)) pipes[0].fd = -1;
    if (pipes[1].revents != 0 && !take_from(pipes[1].fd, answer.error)) pipes[1].fd = -1;
  }
  const bool too_much = answer.output.size() + answer.error.size() > most_bytes;
  if (too_much || !has_ended_by(child, deadline)) {
    answer.timed_out = !too_much;
    ::kill(child, SIGKILL);
  }
  answer.exit_code = wait_for_exit(child);
  return answer;
}

Child::Child(const std::vector<std::string>& command) {
  Pipe output, error;
  pid_ = launch({.command = command, .environment = {}, .output = output.writer(), .error = error.writer()});
  output_ = output.release_reader();
  error_ = error.release_reader();
}

Child::~Child() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    wait_for_exit(pid_);
  }
  ::close(output_);
  ::close(error_);
}

std::string Child::read(std::size_t bytes, Deadline deadline) {
  std::string text(bytes, '\0');
  std::size_t have = 0;
  while (have < bytes) {
    pollfd pipe{output_, POLLIN, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    const int ready = left <= 0 ? 0 : ::poll(&pipe, 1, static_cast<int>(left));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) break;
    const ssize_t got = ::read(output_, text.data() + have, bytes - have);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    have += static_cast<std::size_t>(got);
  }
  text.resize(have);
  return text;
}

Answer Child::end(Deadline deadline) {
  Answer answer;
  if (!has_ended_by(pid_, deadline)) {
    answer.timed_out = true;
    ::kill(pid_, SIGKILL);
  }
  answer.exit_code = wait_for_exit(std::exchange(pid_, -1));
  std::array<char, 4096> text;
  const ssize_t got = ::read(error_, text.data(), text.size());  // all that it said is in the pipe: it has ended
  if (got > 0) answer.error.assign(text.data(), static_cast<std::size_t>(got));
  return answer;
}

std::optional<std::uint64_t> start_ticks(pid_t process) {
  const auto fields = stat_fields(process);
  if (fields.size() < 20 || fields[0] == "Z") return std::nullopt;
  return std::stoull(fields[19]);
}

std::string command_line(pid_t process) {
  return process_file(process, "cmdline");
}

std::vector<pid_t> session_members(pid_t session) {
  std::vector<pid_t> members;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    pid_t process = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), process);
    if (error != std::errc() || end != name.data() + name.size()) continue;
    const auto fields = stat_fields(process);
    if (fields.size() > 3 && fields[0] != "Z" && fields[3] == std::to_string(session)) members.push_back(process);
  }
  return members;
}

std::string host_name() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

}  // namespace bedflow::server
