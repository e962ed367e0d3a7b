#include "child.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <system_error>

#include "failure.h"

namespace bedflow::client {

namespace {

[[noreturn]] void fail(int error, const std::string& what) {
  throw std::system_error(error, std::generic_category(), what);
}

class File {
 public:
  explicit File(int descriptor = -1) : descriptor_(descriptor) {}
  ~File() { close(); }
  File(File&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  File& operator=(File&& other) noexcept {
    close();
    descriptor_ = std::exchange(other.descriptor_, -1);
    return *this;
  }
  int get() const { return descriptor_; }
  void close() {
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  }

 private:
  int descriptor_;
};

struct Pipe {
  File read, write;
  Pipe() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) fail(errno, "pipe");
    read = File(ends[0]);
    write = File(ends[1]);
  }
};

// No signal of ours is blocked or ignored in the child, whatever this thread has blocked.
pid_t spawn(const std::vector<std::string>& command, posix_spawn_file_actions_t* actions, bool own_session) {
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  const int flags = POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | (own_session ? POSIX_SPAWN_SETSID : 0);
  posix_spawnattr_setflags(&attributes, static_cast<short>(flags));
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const auto& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t pid = -1;
  const int error = posix_spawnp(&pid, arguments[0], actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(actions);
  if (error != 0) fail(error, command.front());
  return pid;
}

// Feeds stdin and drains both outputs at once, so that neither side waits for the other.
void exchange(Pipe& in, Pipe& out, Pipe& error, const std::string& input, ChildResult& result) {
  fcntl(in.write.get(), F_SETFL, O_NONBLOCK);
  std::size_t written = 0;
  if (input.empty()) in.write.close();
  std::array<char, 65536> buffer;
  while (out.read.get() >= 0 || error.read.get() >= 0) {
    std::array<pollfd, 3> wait = {{{in.write.get(), POLLOUT, 0}, {out.read.get(), POLLIN, 0}, {error.read.get(), POLLIN, 0}}};
    if (poll(wait.data(), wait.size(), -1) < 0 && errno != EINTR) fail(errno, "poll");
    if (wait[0].revents != 0) {
      const auto count = write(in.write.get(), input.data() + written, input.size() - written);
      if (count > 0) written += static_cast<std::size_t>(count);
      if ((count < 0 && errno != EAGAIN) || written == input.size()) in.write.close();
    }
    const auto drain = [&](const pollfd& ready, File& file, std::string& text) {
      if (ready.revents == 0) return;
      const auto count = read(file.get(), buffer.data(), buffer.size());
      if (count > 0) text.append(buffer.data(), static_cast<std::size_t>(count));
      if (count == 0) file.close();
    };
    drain(wait[1], out.read, result.out);
    drain(wait[2], error.read, result.error);
  }
}

}  // namespace

std::filesystem::path beside_own_executable(const std::string& name) {
  auto path = std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
  if (!std::filesystem::exists(path)) {
    throw Failure(Exit::other, "the program " + name + " is not beside bedflow, in " + path.parent_path().string(),
                  "install or build " + name + " into that folder");
  }
  return path;
}

ChildResult run_child(const std::vector<std::string>& command, const std::string& input) {
  signal(SIGPIPE, SIG_IGN);  // a child that ends before it has read everything is told by its exit code
  Pipe in, out, error;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.read.get(), 0);
  posix_spawn_file_actions_adddup2(&actions, out.write.get(), 1);
  posix_spawn_file_actions_adddup2(&actions, error.write.get(), 2);
  const pid_t pid = spawn(command, &actions, false);
  in.read.close();
  out.write.close();
  error.write.close();
  ChildResult result;
  exchange(in, out, error, input, result);
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

pid_t start_detached(const std::vector<std::string>& command, const std::filesystem::path& log) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  return spawn(command, &actions, true);
}

}  // namespace bedflow::client
