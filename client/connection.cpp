#include "connection.h"

#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <optional>
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

v1::Context near_context(const std::string& address) {
  v1::Context context;
  context.set_server(address);
  return context;
}

std::shared_ptr<grpc::ChannelCredentials> credentials_of(const v1::Context& context) {
  if (!wants_tls(context)) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions options;
  if (context.has_ca()) options.pem_root_certs = read_pem(context.ca(), false);
  if (context.has_certificate()) options.pem_cert_chain = read_pem(context.certificate(), false);
  if (context.has_key()) options.pem_private_key = read_pem(context.key(), true);
  auto credentials = grpc::SslCredentials(options);
  if (!context.has_token()) return credentials;
  return grpc::CompositeChannelCredentials(credentials, grpc::AccessTokenCredentials(read_token_file(context.token())));
}

// What is refused at the server's door has no details: the reason stands at the end of the message, in brackets.
std::string reason_in(const std::string& message) {
  const auto begin = message.rfind('[');
  return message.ends_with(']') && begin != message.npos ? message.substr(begin + 1, message.size() - begin - 2) : "";
}

std::string next_after_refusal(const std::string& reason, const v1::Context& context) {
  const std::string name = context.has_name() ? context.name() : "NAME";
  if (reason == "TOKEN_MISSING")
    return "bedflow context add " + name + " --server " + context.server() +
           " --ca FILE --token FILE, with a token from an admin";
  if (reason == "SCOPE_TOO_SMALL") return "ask an admin for a token of a larger scope; who you are: bedflow server info";
  return "ask an admin of the server for a token (bedflow server token create), and put it into " +
         (context.has_token() ? context.token() : "the file of --token");
}

// Of a connection that TLS did not let come about: the words of the library, in ours.
std::string tls_trouble(const std::string& told) {
  std::string text = told;
  for (char& c : text) c = c == ' ' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const auto has = [&](const char* words) { return text.find(words) != text.npos; };
  if (has("certificate_verify_failed")) return "its certificate is not of an authority that you trust, or not of this time";
  if (has("peer_name") || has("hostname_verification")) return "its certificate is not for this host name";
  if (has("wrong_version_number") || has("handshake"))
    return "the TLS handshake failed: it may speak no TLS, or want a client's certificate";
  return "";
}

}  // namespace

std::string default_address() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  const auto base = state && *state ? std::filesystem::path(state) : std::filesystem::path(home ? home : "/") / ".local/state";
  return "unix:" + (base / "bedflow/bedflowd.sock").string();
}

Connection::Connection(const std::string& address) : Connection(near_context(address)) {}

Connection::Connection(const v1::Context& context) : context_(context), address_(context.server()) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(largest_message);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);  // an engine's server is near: no proxy stands between
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  // How long one attempt may take, in gRPC's words: a handshake over a network, or on a machine that is busy.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, wants_tls(context_) ? 10'000 : 1000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
  stub_ = v1::JobService::NewStub(grpc::CreateCustomChannel(address_, credentials_of(context_), arguments));
}

grpc::Status Connection::run(const Attempt& attempt, double seconds) const {
  std::optional<WaitingNote> note;
  if (!quiet_) note.emplace(address_);
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
  if (!told && exit_of(status.error_code()) == Exit::not_allowed) {
    return {Exit::not_allowed, status.error_message(), next_after_refusal(reason_in(status.error_message()), context_)};
  }
  const std::string trouble = wants_tls(context_) ? tls_trouble(status.error_message()) : "";
  if (!told && status.error_code() == grpc::UNAVAILABLE && !trouble.empty()) {
    return {Exit::unreachable, "no trusted connection to " + address_ + ": " + trouble + " (" + status.error_message() + ")",
            "bedflow context show; --ca names the authority, --certificate and --key what the server may ask for"};
  }
  if (!told && status.error_code() == grpc::UNAVAILABLE) {
    return {Exit::unreachable, "no server answers at " + address_ + " (" + status.error_message() + ")",
            "start one with `bedflowd`, name another with --server or --context, or run without one: `bedflow run CASE`"};
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
