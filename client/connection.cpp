#include "connection.h"

#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <thread>

#include "terminal.h"

namespace bedflow::client {

namespace {

constexpr int largest_message = 512 << 20;  // a snapshot of 20 million particles

// Tells a person that something is under way when an answer takes longer than what feels immediate.
class WaitingNote {
 public:
  explicit WaitingNote(const std::string& address) {
    if (!Terminal(stderr).interactive()) return;
    thread_ = std::jthread([this, address](const std::stop_token& stop) {
      std::unique_lock lock(mutex_);
      if (wake_.wait_for(lock, stop, std::chrono::milliseconds(80), [&] { return stop.stop_requested(); })) return;
      std::fputs(("waiting for " + address + " ...").c_str(), stderr);
      wake_.wait(lock, stop, [] { return false; });
      std::fputs("\r\033[K", stderr);
    });
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

Exit exit_of(grpc::StatusCode code) {
  switch (code) {
    case grpc::INVALID_ARGUMENT:
    case grpc::OUT_OF_RANGE:
      return Exit::usage;
    case grpc::PERMISSION_DENIED:
    case grpc::UNAUTHENTICATED:
      return Exit::not_allowed;
    case grpc::NOT_FOUND:
      return Exit::not_found;
    case grpc::FAILED_PRECONDITION:
    case grpc::ALREADY_EXISTS:
    case grpc::ABORTED:
      return Exit::wrong_state;
    case grpc::UNAVAILABLE:
      return Exit::unreachable;
    case grpc::DEADLINE_EXCEEDED:
      return Exit::timed_out;
    case grpc::RESOURCE_EXHAUSTED:
      return Exit::limit;
    case grpc::CANCELLED:
      return Exit::cancelled;
    case grpc::DATA_LOSS:
      return Exit::corrupt;
    default:
      return Exit::other;
  }
}

}  // namespace

std::string default_address() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  const auto base = state && *state ? std::filesystem::path(state) : std::filesystem::path(home ? home : "/") / ".local/state";
  return "unix:" + (base / "bedflow/bedflowd.sock").string();
}

Connection::Connection(std::string address) : address_(std::move(address)) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(largest_message);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);  // an engine's server is near: no proxy stands between
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
  stub_ = v1::JobService::NewStub(grpc::CreateCustomChannel(address_, grpc::InsecureChannelCredentials(), arguments));
}

grpc::Status Connection::run(const Attempt& attempt, double seconds) const {
  const WaitingNote note(address_);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1e3)));
  return attempt(&context);
}

v1::Job Connection::get_job(const std::string& id, bool with_case) const {
  v1::GetJobRequest request;
  request.set_id(id);
  if (with_case) request.set_with_case(true);
  return call(&Stub::GetJob, request);
}

Failure Connection::failure_of(const grpc::Status& status) const {
  v1::ErrorDetail detail;
  const bool told = !status.error_details().empty() && detail.ParseFromString(status.error_details());
  if (!told && status.error_code() == grpc::UNAVAILABLE) {
    return {Exit::unreachable, "no server answers at " + address_ + " (" + status.error_message() + ")",
            "start one with `bedflowd`, name another with --server or BEDFLOW_SERVER, or run without one: `bedflow run CASE`"};
  }
  if (!told && status.error_code() == grpc::DEADLINE_EXCEEDED) {
    return {Exit::timed_out, "the server at " + address_ + " did not answer in time", "bedflow server info"};
  }
  std::vector<CaseFault> faults;
  for (const auto& fault : detail.faults()) faults.push_back({fault.path(), fault.text()});
  Exit code = exit_of(status.error_code());
  if (detail.reason() == "INVALID_CASE") code = Exit::usage;
  const std::string reason = detail.reason().empty() ? "" : " [" + detail.reason() + "]";
  return {code, status.error_message() + reason, detail.next(), std::move(faults)};
}

}  // namespace bedflow::client
