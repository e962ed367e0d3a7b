// The calls about tokens.
#include <spdlog/spdlog.h>

#include "service.h"

namespace bedflow::server {

JobService::Unary* JobService::CreateToken(Context* context, const v1::CreateTokenRequest* request, v1::Token* response) {
  return answer(context, Pace::slow, [=, this](const Caller& caller) {
    *response = tokens_.add(request->token());
    spdlog::info("{} has made the token {} of {}: {}", caller.owner, response->id(), response->owner(),
                 v1::Scope_Name(response->scope()));
  });
}

JobService::Unary* JobService::ListTokens(Context* context, const v1::ListTokensRequest*, v1::ListTokensResponse* response) {
  return answer(context, Pace::quick, [=, this](const Caller&) {
    for (auto& token : tokens_.list()) *response->add_tokens() = std::move(token);
  });
}

JobService::Unary* JobService::RevokeToken(Context* context, const v1::RevokeTokenRequest* request,
                                           v1::RevokeTokenResponse* response) {
  return answer(context, Pace::slow, [=, this](const Caller& caller) {
    for (auto& token : tokens_.revoke(request->id(), request->owner())) {
      spdlog::info("{} has revoked the token {} of {}", caller.owner, token.id(), token.owner());
      *response->add_tokens() = std::move(token);
    }
  });
}

}  // namespace bedflow::server
