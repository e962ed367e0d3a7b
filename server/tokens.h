// The tokens that open the server to the network: DATA/tokens.txtpb, replaced as a whole. Of a secret there is only its hash.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <vector>

#include "caller.h"

namespace bedflow::server {

// What became of a token that was shown. Unknown: its id or its secret, which is not told.
enum class Shown { good, none, malformed, unknown, expired };

class Tokens {
 public:
  explicit Tokens(std::filesystem::path file);  // that need not be there; throws std::runtime_error for one that is damaged

  // Throws Refusal: bad_request for a token that is not in order, and for an id that there is.
  v1::Token add(v1::Token token);
  std::vector<v1::Token> list() const;  // oldest first, without their hashes
  // Those of an id, or of an owner: they hold no longer, in calls under way neither. Throws Refusal (bad_request): there is none.
  std::vector<v1::Token> revoke(const std::string& id, const std::string& owner);
  bool empty() const;

  // authorization: "Bearer bedflow_...". From any thread; the time it takes tells nothing of a secret.
  Shown look_at(std::string_view authorization, Caller& caller) const;
  Caller caller_of(const std::string& id) const;  // throws Refusal(token_ended) when it no longer holds

 private:
  using Known = std::map<std::string, std::shared_ptr<KnownToken>>;
  std::shared_ptr<KnownToken> find(const std::string& id) const;
  void store(const Known& known) const;

  const std::filesystem::path file_;
  mutable std::shared_mutex mutex_;
  Known known_;  // by id
};

}  // namespace bedflow::server
