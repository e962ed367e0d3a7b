#include "door.h"

#include <spdlog/spdlog.h>

#include <functional>
#include <map>

#include "refusal.h"
#include "security.h"

namespace bedflow::server {
namespace {

constexpr const char* authorization = "authorization";
constexpr const char* caller_key = "bedflow-caller";  // in a call's metadata, once the token is off
constexpr const char* by_socket = "local";            // no id of a token

std::string_view view_of(const grpc::string_ref& text) {
  return {text.data(), text.size()};
}

// All that is shown as authorization must be one thing.
template <class Metadata>
std::string_view shown_in(const Metadata& metadata) {
  if (metadata.count(authorization) != 1) return metadata.count(authorization) == 0 ? "" : "several";
  return view_of(metadata.find(authorization)->second);
}

std::map<std::string, v1::Scope, std::less<>> scopes_of_schema() {
  std::map<std::string, v1::Scope, std::less<>> scopes;
  const auto* file = v1::Job::descriptor()->file();
  for (int s = 0; s < file->service_count(); ++s) {
    const auto* service = file->service(s);
    for (int m = 0; m < service->method_count(); ++m) {
      const auto* method = service->method(m);
      scopes["/" + service->full_name() + "/" + method->name()] = method->options().GetExtension(v1::needs);
    }
  }
  return scopes;
}

// Puts the id of a call's token, or by_socket, in the place of the token.
class TokenTaker final : public grpc::experimental::Interceptor {
 public:
  TokenTaker(const Tokens& tokens, const grpc::ServerContextBase* context) : tokens_(tokens), context_(context) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      auto& metadata = *methods->GetRecvInitialMetadata();
      caller_ = caller(metadata);
      metadata.erase(authorization);
      metadata.erase(caller_key);  // whatever the client says of itself
      metadata.emplace(caller_key, caller_);
    }
    methods->Proceed();
  }

 private:
  // Whatever did not come over a Unix socket has come over TLS: there is nothing else (listen.cpp).
  std::string caller(const std::multimap<grpc::string_ref, grpc::string_ref>& metadata) const {
    if (context_->peer().starts_with("unix:")) return by_socket;
    Caller holder;
    return tokens_.look_at(shown_in(metadata), holder) == Shown::good ? holder.token->token.id() : "";
  }

  const Tokens& tokens_;
  const grpc::ServerContextBase* context_;
  std::string caller_;
};

class TakerFactory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit TakerFactory(const Tokens& tokens) : tokens_(tokens) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override {
    return new TokenTaker(tokens_, info->server_context());
  }

 private:
  const Tokens& tokens_;
};

}  // namespace

v1::Scope scope_needed(std::string_view path) {
  static const auto scopes = scopes_of_schema();
  if (path.starts_with("/grpc.health.v1.Health/") || path.starts_with("/grpc.reflection.")) return v1::READ;
  const auto known = scopes.find(path);
  return known == scopes.end() ? v1::SCOPE_NONE : known->second;
}

grpc::Status Gate::Process(const InputMetadata& metadata, grpc::AuthContext*, OutputMetadata*, OutputMetadata*) {
  const auto found = metadata.find(":path");
  const std::string path(found == metadata.end() ? "" : view_of(found->second));
  Caller caller;
  switch (tokens_.look_at(shown_in(metadata), caller)) {
    case Shown::none:
      return turn_away(grpc::UNAUTHENTICATED, path, "this server asks for a token", "TOKEN_MISSING");
    case Shown::malformed:
      return turn_away(grpc::UNAUTHENTICATED, path, "what was shown is no token of bedflow", "TOKEN_MALFORMED");
    case Shown::unknown:
      return turn_away(grpc::UNAUTHENTICATED, path, "the server does not know the token; it is another server's, or was revoked",
                       "TOKEN_UNKNOWN");
    case Shown::expired:
      return turn_away(grpc::UNAUTHENTICATED, path, "the token has expired", "TOKEN_EXPIRED");
    case Shown::good:
      break;
  }
  const auto needed = scope_needed(path);
  if (needed != v1::SCOPE_NONE && caller.scope >= needed) return grpc::Status::OK;
  const std::string name = path.substr(path.rfind('/') + 1);
  const std::string needs = needed == v1::SCOPE_NONE ? "is not open to tokens" : "needs the scope " + v1::Scope_Name(needed);
  return turn_away(grpc::PERMISSION_DENIED, path,
                   printable(name) + " " + needs + "; the token of " + caller.owner + " has " + v1::Scope_Name(caller.scope),
                   "SCOPE_TOO_SMALL");
}

grpc::Status Gate::turn_away(grpc::StatusCode code, const std::string& path, const std::string& why, const char* reason) {
  if (const auto more = told_.now()) spdlog::warn("turned away: {}: {} [{}]{}", printable(path), why, reason, *more);
  return {code, why + " [" + reason + "]"};
}

Caller Door::caller(const grpc::CallbackServerContext& context) const {
  if (!has_network_) return {};
  const auto found = context.client_metadata().find(caller_key);
  const std::string_view id = found == context.client_metadata().end() ? "" : view_of(found->second);
  return id == by_socket ? Caller() : tokens_.caller_of(std::string(id));
}

std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> Door::interceptors() const {
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> all;
  if (has_network_) all.push_back(std::make_unique<TakerFactory>(tokens_));
  return all;
}

}  // namespace bedflow::server
