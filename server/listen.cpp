#include "listen.h"

#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "rarely.h"
#include "security.h"

namespace bedflow::server {
namespace {

bool is_socket(const std::string& address) {
  return address.starts_with("unix:");
}

// gRPC tells of handshakes that fail, a line each, and of certificates that it cannot use. Strangers bring about the first: what
// comes from one place of its code is limited by itself.
void tell_what_grpc_says(gpr_log_func_args* said) {
  static std::mutex mutex;
  static std::map<std::pair<std::string, int>, Rarely> places;
  Rarely* place = nullptr;
  {
    const std::lock_guard guard(mutex);
    place = &places[{said->file, said->line}];
  }
  const auto more = place->now();
  if (auto* log = spdlog::default_logger_raw(); log && more) log->error("grpc: {}{}", printable(said->message), *more);
}

}  // namespace

std::vector<std::string> addresses(const Listening& listening, const std::filesystem::path& data) {
  std::vector<std::string> all;
  for (const auto& wanted : listening.wanted) all.push_back(listen_address(wanted, listening.has_network()));
  const bool has_tcp = !std::all_of(all.begin(), all.end(), is_socket);
  if (listening.has_network() && !has_tcp)
    throw std::invalid_argument("TLS is for the network: add --listen HOST:PORT, 0.0.0.0:7443 say");
  const bool has_socket = std::any_of(all.begin(), all.end(), is_socket);
  if (all.empty() || (listening.has_network() && !has_socket))
    all.push_back(listen_address("unix:" + (data / "bedflowd.sock").string()));
  return all;
}

std::unique_ptr<grpc::Server> listen(const Listening& listening, std::vector<std::string>& addresses, grpc::Service& service,
                                     const Door& door, const Tokens& tokens, CallMeter& calls) {
  gpr_set_log_function(tell_what_grpc_says);
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  const auto tls = listening.has_network() ? tls_credentials(listening.tls, std::make_shared<Gate>(tokens)) : nullptr;
  std::vector<int> ports(addresses.size(), 0);
  for (std::size_t i = 0; i < addresses.size(); ++i) {
    const bool is_plain = is_socket(addresses[i]) || !tls;
    if (is_plain && !is_socket(addresses[i]))
      spdlog::warn("whoever can log in to this machine can use the server on {}; a socket keeps others out", addresses[i]);
    builder.AddListeningPort(addresses[i], is_plain ? grpc::InsecureServerCredentials() : tls, &ports[i]);
  }
  builder.RegisterService(&service);
  auto takers = door.interceptors();
  takers.insert(takers.begin(), std::make_unique<CallMeterFactory>(calls));  // what the door turns away is counted too
  builder.experimental().SetInterceptorCreators(std::move(takers));
  builder.SetMaxReceiveMessageSize(32 << 20);
  builder.SetResourceQuota(grpc::ResourceQuota("bedflowd").Resize(512 << 20));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 1000);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 10'000);
  auto server = builder.BuildAndStart();
  for (std::size_t i = 0; i < addresses.size(); ++i) {
    if (!server || ports[i] == 0) throw std::runtime_error("cannot listen on " + addresses[i]);
    if (!is_socket(addresses[i])) addresses[i] = addresses[i].substr(0, addresses[i].rfind(':') + 1) + std::to_string(ports[i]);
  }
  return server;
}

}  // namespace bedflow::server
