#include "local_executor.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "open_file.h"
#include "process.h"

namespace bedflow::server {
namespace {

bool lock_is_held(const JobFolder& folder, std::uint32_t epoch) {
  const OpenFile lock(folder.lock(epoch), O_RDONLY);
  return lock.get() >= 0 && ::flock(lock.get(), LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

// Processes of an attempt. Ranks outlive a killed mpirun, and with it the lock, by a second or two: they are told by the folder
// on their command line, so that a session number that has been given to others harms nobody.
std::vector<pid_t> members(const JobFolder& folder, std::uint32_t epoch) {
  v1::Runner runner;
  if (!read_message(folder.runner(epoch), runner)) return {};
  auto found = session_members(static_cast<pid_t>(runner.pid()));
  std::erase_if(found, [&](pid_t member) { return command_line(member).find(folder.root().string()) == std::string::npos; });
  return found;
}

bool is_alive(const JobFolder& folder, std::uint32_t epoch) {
  return lock_is_held(folder, epoch) || !members(folder, epoch).empty();
}

}  // namespace

void LocalExecutor::start(const JobFolder& folder, const AttemptOrder& order) {
  const auto epoch = order.epoch;
  for (const auto earlier : folder.epochs()) {
    if (is_alive(folder, earlier)) throw std::runtime_error("attempt " + std::to_string(earlier) + " still runs");
  }
  std::filesystem::create_directories(folder.attempt(epoch));
  sync_folder(folder.attempts());
  const OpenFile lock(folder.lock(epoch), O_RDWR | O_CREAT, 0600);
  const OpenFile output(folder.output_log(epoch), O_WRONLY | O_CREAT | O_APPEND, 0600);
  const OpenFile error(folder.error_log(epoch), O_WRONLY | O_CREAT | O_APPEND, 0600);
  if (lock.get() < 0 || output.get() < 0 || error.get() < 0) {
    throw std::system_error(errno, std::generic_category(), "creating the files of " + folder.attempt(epoch).string());
  }
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) throw std::runtime_error("attempt " + std::to_string(epoch) + " is taken");
  reserve(folder.runner(epoch));  // a disk that fills up later does not keep the runner from saying how it ended
  reserve(folder.exit_record(epoch));

  std::vector<std::string> command = {
      programs_.server, "run-attempt",    folder.root(), std::to_string(epoch),       "--engine",          programs_.engine,
      "--mpirun",       programs_.mpirun, "--ranks",     std::to_string(order.ranks), "--lock-descriptor", "3"};
  if (order.from_step) command.insert(command.end(), {"--from", std::to_string(*order.from_step)});
  runners_.push_back(launch({.command = command,
                             .environment = {},
                             .output = output.get(),
                             .error = error.get(),
                             .kept = lock.get(),
                             .new_session = true}));
}

Sighting LocalExecutor::look(const JobFolder& folder, std::uint32_t epoch, std::chrono::steady_clock::duration) {
  return {.where = is_alive(folder, epoch) ? Sighting::Where::there : Sighting::Where::gone,
          .waits_for = {},
          .ending = {},
          .batch_job = {},
          .node = {}};
}

void LocalExecutor::kill(const JobFolder& folder, std::uint32_t epoch) {
  for (const pid_t member : members(folder, epoch)) ::kill(member, SIGKILL);
}

void LocalExecutor::tidy() {
  std::erase_if(runners_, [](pid_t runner) { return ::waitpid(runner, nullptr, WNOHANG) == runner; });
}

}  // namespace bedflow::server
