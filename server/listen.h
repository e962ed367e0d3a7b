// Where the server is to be found: the socket in its private folder, loopback, and the network behind TLS and tokens.
#pragma once

#include <grpcpp/grpcpp.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "door.h"
#include "metrics.h"
#include "tls.h"

namespace bedflow::server {

struct Listening {
  std::vector<std::string> wanted;  // unix:PATH, HOST:PORT; empty: the socket in the data folder
  TlsFiles tls;

  bool has_network() const { return tls.given(); }  // TCP is TLS then, loopback too
};

// The addresses, checked. With a network the socket in the data folder is among them unless another is named: whoever runs the
// server gets in there, to make the first token. Throws std::invalid_argument.
std::vector<std::string> addresses(const Listening& listening, const std::filesystem::path& data);

// Listens; a port 0 in the addresses becomes the one that it was given. Throws std::runtime_error.
std::unique_ptr<grpc::Server> listen(const Listening& listening, std::vector<std::string>& addresses, grpc::Service& service,
                                     const Door& door, const Tokens& tokens, CallMeter& calls);

}  // namespace bedflow::server
