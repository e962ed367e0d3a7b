#include "tokens.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "folder.h"
#include "refusal.h"
#include "security.h"
#include "token.h"

namespace bedflow::server {
namespace {

constexpr std::size_t most_tokens = 10'000;
constexpr std::chrono::hours longest_life{24 * 3660};

v1::Token without_hash(v1::Token token) {
  token.clear_secret_sha256();
  return token;
}

Caller caller_with(std::shared_ptr<const KnownToken> known) {
  return {known->token.owner(), known->token.scope(), std::move(known)};
}

void require_sound(const v1::Token& token) {
  const auto wrong = [](const std::string& what) {
    throw Refusal(Refused::bad_request, what, "bedflow server token create --help");
  };
  if (!is_token_id(token.id())) wrong("token.id '" + printable(token.id()) + "' is not 12 hex digits");
  if (!is_owner(token.owner()))
    wrong("token.owner '" + printable(token.owner()) + "' is not of the form [a-z0-9][a-z0-9._-]{0,62}");
  if (token.owner() == local_owner) wrong("token.owner is 'local': that is whoever may open the server's socket");
  if (token.scope() == v1::SCOPE_NONE) wrong("token.scope is missing; there are READ, SUBMIT and ADMIN");
  if (token.secret_sha256().size() != 32) wrong("token.secret_sha256 is not 32 bytes");
  const std::int64_t now = now_nanos(), expires = token.expires_unix_nanos();
  if (expires <= now || std::chrono::nanoseconds(expires - now) > longest_life)
    wrong("token.expires_unix_nanos is not between now and ten years from now");
}

[[noreturn]] void refuse_ended(const std::string& id) {
  throw Refusal(Refused::token_ended, "the token " + printable(id) + " has been revoked or has expired while the call went on",
                "ask an admin of the server for another: bedflow server token create");
}

}  // namespace

void Caller::require_still_good() const {
  if (!token || token->holds()) return;
  refuse_ended(token->token.id());
}

Tokens::Tokens(std::filesystem::path file) : file_(std::move(file)) {
  if (!std::filesystem::exists(file_)) return;
  v1::ListTokensResponse kept;
  if (!read_message(file_, kept)) throw std::runtime_error("the tokens in " + file_.string() + " cannot be read");
  for (auto& token : *kept.mutable_tokens()) {
    auto& known = known_[token.id()] = std::make_shared<KnownToken>();
    known->token = std::move(token);
  }
}

void Tokens::store(const Known& known) const {
  v1::ListTokensResponse kept;
  for (const auto& [id, one] : known) *kept.add_tokens() = one->token;
  write_durably(file_, kept);
}

v1::Token Tokens::add(v1::Token token) {
  require_sound(token);
  token.set_created_unix_nanos(now_nanos());
  const std::lock_guard guard(mutex_);
  if (known_.contains(token.id())) throw Refusal(Refused::bad_request, "there is a token " + token.id() + " already");
  if (known_.size() >= most_tokens) {
    throw Refusal(Refused::too_much, "the server has " + std::to_string(most_tokens) + " tokens, and takes no more",
                  "bedflow server token revoke ID");
  }
  Known changed = known_;
  auto& known = changed[token.id()] = std::make_shared<KnownToken>();
  known->token = std::move(token);
  v1::Token made = without_hash(known->token);
  store(changed);  // before anybody can use it
  known_ = std::move(changed);
  return made;
}

std::vector<v1::Token> Tokens::list() const {
  std::vector<v1::Token> all;
  {
    const std::shared_lock guard(mutex_);
    for (const auto& [id, known] : known_) all.push_back(without_hash(known->token));
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.created_unix_nanos() < b.created_unix_nanos(); });
  return all;
}

std::vector<v1::Token> Tokens::revoke(const std::string& id, const std::string& owner) {
  if (id.empty() == owner.empty()) throw Refusal(Refused::bad_request, "revoke takes the id of a token, or an owner");
  std::vector<v1::Token> gone;
  const std::lock_guard guard(mutex_);
  Known left;
  for (const auto& [known_id, known] : known_) {
    if (known_id == id || known->token.owner() == owner) {
      gone.push_back(without_hash(known->token));
    } else {
      left.emplace(known_id, known);
    }
  }
  if (gone.empty()) {
    throw Refusal(Refused::token_not_found, "there is no token " + (id.empty() ? "of " + printable(owner) : printable(id)),
                  "bedflow server token list");
  }
  store(left);
  for (const auto& token : gone) known_.at(token.id())->revoked = true;
  known_ = std::move(left);
  return gone;
}

bool Tokens::empty() const {
  const std::shared_lock guard(mutex_);
  return known_.empty();
}

std::shared_ptr<KnownToken> Tokens::find(const std::string& id) const {
  const std::shared_lock guard(mutex_);
  const auto known = known_.find(id);
  return known == known_.end() ? nullptr : known->second;
}

Shown Tokens::look_at(std::string_view authorization, Caller& caller) const {
  constexpr std::string_view scheme = "bearer ";
  if (authorization.empty()) return Shown::none;
  const bool is_bearer = authorization.size() > scheme.size() &&
                         std::equal(scheme.begin(), scheme.end(), authorization.begin(),
                                    [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
  const auto text = is_bearer ? read_token(authorization.substr(scheme.size())) : std::nullopt;
  if (!text) return Shown::malformed;
  static const std::string nobodys(32, '\0');  // the same work for an id that there is not
  const auto known = find(text->id);
  const bool is_right = is_same_hash(sha256(text->secret), known ? known->token.secret_sha256() : nobodys);
  if (!known || !is_right || known->revoked) return Shown::unknown;
  if (!known->holds()) return Shown::expired;
  caller = caller_with(known);
  return Shown::good;
}

Caller Tokens::caller_of(const std::string& id) const {
  const auto known = find(id);
  if (known && known->holds()) return caller_with(known);
  refuse_ended(id);
}

}  // namespace bedflow::server
