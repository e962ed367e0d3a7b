// Who comes in. Over the socket in the server's private folder: the server's own user. Over TLS: who shows a token whose scope
// goes as far as the method needs. That is judged before a request is read, so what is turned away costs no more than its
// headers; then the token is taken off the call, and its id, which is no secret, put in its place: handlers see no more.
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/security/auth_metadata_processor.h>
#include <grpcpp/support/server_interceptor.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "caller.h"
#include "rarely.h"
#include "tokens.h"

namespace bedflow::server {

// What a method needs, by its path ("/bedflow.v1.JobService/GetJob"), from the schema. SCOPE_NONE: it is closed.
v1::Scope scope_needed(std::string_view path);

// Turns away calls over TLS. gRPC asks it once a call, as soon as the headers are there.
class Gate final : public grpc::AuthMetadataProcessor {
 public:
  explicit Gate(const Tokens& tokens) : tokens_(tokens) {}
  bool IsBlocking() const override { return false; }
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext*, OutputMetadata*, OutputMetadata*) override;

 private:
  grpc::Status turn_away(grpc::StatusCode code, const std::string& path, const std::string& why, const char* reason);

  const Tokens& tokens_;
  Rarely told_;
};

class Door {
 public:
  // Without a network, all who come in come over the socket.
  Door(const Tokens& tokens, bool has_network) : tokens_(tokens), has_network_(has_network) {}

  // In whose name a call is made. Throws Refusal(token_ended).
  Caller caller(const grpc::CallbackServerContext& context) const;
  // What takes the tokens off the calls; none without a network.
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors() const;

 private:
  const Tokens& tokens_;
  const bool has_network_;
};

}  // namespace bedflow::server
