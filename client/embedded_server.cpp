#include "embedded_server.h"

#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <thread>

#include "child.h"
#include "connection.h"

namespace bedflow::client {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds start_limit{30}, stop_limit{10};
constexpr int most_starts = 5;

std::string last_of(const std::filesystem::path& log) {
  std::ifstream file(log);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  return text.substr(text.size() > 800 ? text.size() - 800 : 0);
}

}  // namespace

EmbeddedServer::EmbeddedServer(const std::filesystem::path& data) {
  std::error_code error;
  std::filesystem::create_directories(data, error);
  if (error)
    throw Failure(Exit::other, "the data folder " + data.string() + " cannot be made: " + error.message(),
                  "choose another with --data");
  data_ = std::filesystem::canonical(data);
  chmod(data_.c_str(), 0700);
  log_ = data_ / "bedflowd.log";
  const auto socket = data_ / "bedflowd.sock";
  if (socket.string().size() >= sizeof(sockaddr_un::sun_path)) {
    throw Failure(Exit::usage,
                  "the path " + socket.string() + " is too long for a socket: " + std::to_string(socket.string().size()) +
                      " bytes, at most " + std::to_string(sizeof(sockaddr_un::sun_path) - 1),
                  "choose a shorter --data");
  }
  address_ = "unix:" + socket.string();
  if (std::filesystem::exists(socket) && answers(2)) return;
  start();
}

EmbeddedServer::~EmbeddedServer() {
  if (child_ < 0 || left_) return;
  try {
    const auto info = Connection(address_).call(&Stub::GetServerInfo, v1::GetServerInfoRequest(), 5);
    if (info.jobs_running() + info.jobs_pending() > 0) return;
  } catch (const Failure&) {  // it does not answer: nothing is lost by ending it, jobs outlive their server
  }
  kill(child_, SIGTERM);
  const auto limit = Clock::now() + stop_limit;
  while (!child_ended() && Clock::now() < limit) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

bool EmbeddedServer::answers(double seconds) const {
  try {
    Connection(address_).call(&Stub::GetServerInfo, v1::GetServerInfoRequest(), seconds);
    return true;
  } catch (const Failure&) {
    return false;
  }
}

bool EmbeddedServer::child_ended() {
  if (child_ >= 0 && waitpid(child_, nullptr, WNOHANG) != 0) child_ = -1;
  return child_ < 0;
}

void EmbeddedServer::start() {
  if (starts_++ == most_starts) {
    throw Failure(Exit::unreachable, "the embedded server died " + std::to_string(most_starts) + " times: " + last_of(log_),
                  "its log is " + log_.string());
  }
  const auto program = beside_own_executable("bedflowd");
  child_ = start_detached({program.string(), "--data", data_.string(), "--idle-exit"}, log_);
  wait_until_ready();
}

void EmbeddedServer::wait_until_ready() {
  const auto limit = Clock::now() + start_limit;
  while (!answers(1)) {
    if (child_ended())
      throw Failure(Exit::unreachable, "the embedded server did not start: " + last_of(log_), "its log is " + log_.string());
    if (Clock::now() > limit)
      throw Failure(Exit::unreachable, "the embedded server does not answer: " + last_of(log_), "its log is " + log_.string());
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

void EmbeddedServer::revive() {
  if (answers(1)) return;
  if (child_ended()) start();
}

}  // namespace bedflow::client
