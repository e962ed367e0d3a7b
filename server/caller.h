// In whose name a call is made, and how far it may go: v1::Scope says what each allows.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "bedflow/v1/service.pb.h"
#include "clock.h"

namespace bedflow::server {

inline constexpr const char* local_owner = "local";  // whoever can open the server's socket: the server's own user

// A token that the server knows.
struct KnownToken {
  v1::Token token;
  std::atomic<bool> revoked = false;

  bool holds() const { return !revoked && now_nanos() < token.expires_unix_nanos(); }
};

struct Caller {
  std::string owner = local_owner;
  v1::Scope scope = v1::ADMIN;
  std::shared_ptr<const KnownToken> token = {};  // none: local

  // On what is somebody's: a job, a study.
  bool may_act_on(const std::string& somebody) const { return scope >= v1::ADMIN || (scope >= v1::SUBMIT && somebody == owner); }
  void require_still_good() const;  // a call may last longer than its token; throws Refusal(token_ended)
};

}  // namespace bedflow::server
