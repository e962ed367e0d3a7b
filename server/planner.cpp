#include "planner.h"

#include <google/protobuf/text_format.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>

#include "process.h"
#include "refusal.h"
#include "security.h"

namespace bedflow::server {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto longest_answer = 30s;
constexpr std::size_t most_answer_bytes = 16 << 20;
constexpr std::size_t most_idle = 2;
constexpr auto patience = 100ms;  // for an engine that is busy with another caller's plan, before one more is started

// Which file a program is: another one after an upgrade.
std::pair<std::uint64_t, std::int64_t> identity(const std::filesystem::path& program) {
  struct stat status {};
  if (::stat(program.c_str(), &status) != 0) return {};
  return {status.st_ino, std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec};
}

// A line of the engine's: "path: text".
v1::Fault fault_of(const std::string& line) {
  v1::Fault fault;
  const auto colon = line.find(": ");
  const auto start = line.find_first_not_of(' ');
  const bool has_path =
      colon != std::string::npos && colon > start && line.substr(start, colon - start).find(' ') == std::string::npos;
  if (has_path) fault.set_path(line.substr(start, colon - start));
  fault.set_text(has_path ? line.substr(colon + 2) : line);
  return fault;
}

}  // namespace

// One engine with both ends of its standard input and output.
class Planner::Engine {
 public:
  explicit Engine(const std::filesystem::path& program) : program_(identity(program)) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
      throw std::system_error(errno, std::generic_category(), "socketpair");
    }
    channel_ = ends[0];
    try {
      child_ = launch({.command = {program, "--plans"}, .environment = {}, .input = ends[1], .output = ends[1]});
    } catch (...) {
      ::close(ends[0]);
      ::close(ends[1]);
      throw;
    }
    ::close(ends[1]);
  }
  ~Engine() {
    ::kill(child_, SIGKILL);
    wait_for_exit(child_);
    ::close(channel_);
  }
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  bool is_of(const std::filesystem::path& program) const { return program_ == identity(program); }

  // Nothing when the engine ends, says what is no answer, or takes too long; it is of no use then.
  std::optional<Answer> ask(const std::string& case_text, std::uint32_t ranks) {
    const auto deadline = Clock::now() + longest_answer;
    if (!send(std::to_string(ranks) + " " + std::to_string(case_text.size()) + "\n" + case_text, deadline)) return std::nullopt;
    std::string got;
    while (got.find('\n') == std::string::npos) {
      if (got.size() > 64 || !receive(got, deadline)) return std::nullopt;
    }
    const auto head_end = got.find('\n');
    Answer answer;
    std::size_t bytes = 0;
    std::istringstream head(got.substr(0, head_end));
    if (!(head >> answer.code >> bytes) || bytes > most_answer_bytes) return std::nullopt;
    while (got.size() < head_end + 1 + bytes) {
      if (!receive(got, deadline)) return std::nullopt;
    }
    answer.text = got.substr(head_end + 1);
    return answer;
  }

 private:
  bool ready(short what, Clock::time_point deadline) const {
    pollfd channel{channel_, what, 0};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    return left > 0 && ::poll(&channel, 1, static_cast<int>(left)) > 0;
  }
  bool send(std::string_view bytes, Clock::time_point deadline) const {
    while (!bytes.empty()) {
      if (!ready(POLLOUT, deadline)) return false;
      const ssize_t sent = ::send(channel_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent < 0 && errno != EINTR && errno != EAGAIN) return false;
      if (sent > 0) bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }
  bool receive(std::string& bytes, Clock::time_point deadline) const {
    std::array<char, 65536> buffer;
    if (!ready(POLLIN, deadline)) return false;
    const ssize_t got = ::recv(channel_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (got > 0) bytes.append(buffer.data(), static_cast<std::size_t>(got));
    return got > 0 || (got < 0 && (errno == EINTR || errno == EAGAIN));
  }

  std::pair<std::uint64_t, std::int64_t> program_;
  int channel_ = -1;
  pid_t child_ = -1;
};

Planner::Planner(std::filesystem::path engine) : program_(std::move(engine)) {}
Planner::~Planner() = default;

std::unique_ptr<Planner::Engine> Planner::take() {
  std::unique_lock guard(mutex_);
  if (busy_ >= most_idle) given_back_.wait_for(guard, patience, [this] { return !idle_.empty() || busy_ < most_idle; });
  ++busy_;
  while (!idle_.empty()) {
    auto engine = std::move(idle_.back());
    idle_.pop_back();
    if (engine->is_of(program_)) return engine;
  }
  return nullptr;
}

void Planner::give_back(std::unique_ptr<Engine> engine) {
  const std::lock_guard guard(mutex_);
  --busy_;
  if (engine && idle_.size() < most_idle) idle_.push_back(std::move(engine));
  given_back_.notify_one();
}

// Nothing when even a new engine has no answer.
std::optional<Planner::Answer> Planner::ask(const std::string& case_text, std::uint32_t ranks) {
  auto engine = take();
  std::optional<Answer> answer;
  try {
    if (engine) answer = engine->ask(case_text, ranks);
    if (!answer) {  // there was none, or it has been killed meanwhile
      engine = std::make_unique<Engine>(program_);
      answer = engine->ask(case_text, ranks);
    }
  } catch (...) {
    give_back(nullptr);
    throw;
  }
  give_back(answer ? std::move(engine) : nullptr);
  return answer;
}

v1::PlanReport Planner::plan(const std::string& case_text, std::uint32_t ranks) {
  const auto answer = ask(case_text, ranks);
  if (!answer) throw Refusal(Refused::backend_error, "the engine died over the plan of this case, or gave none within 30 s");
  if (answer->code == v1::INVALID_CASE) {
    std::vector<v1::Fault> faults;
    std::istringstream lines(answer->text);
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty()) faults.push_back(fault_of(line));
    }
    throw Refusal(Refused::invalid_case, "the engine cannot run this case", "bedflow validate CASE", std::move(faults));
  }
  v1::PlanReport plan;
  if (answer->code != 0 || !google::protobuf::TextFormat::ParseFromString(answer->text, &plan)) {
    throw Refusal(Refused::backend_error, "the engine gave no plan: " + printable(answer->text));
  }
  return plan;
}

}  // namespace bedflow::server
