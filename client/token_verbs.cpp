// server token create, list, revoke. The secret is made here and stays here: the server is told its hash.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>

#include "connection.h"
#include "open_file.h"
#include "terminal.h"
#include "token.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct TokenOptions {
  std::string owner, id, out;
  std::string scope;
  std::string expires = "90d";
  Format format = Format::table;
};

std::int64_t now_nanos() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::chrono::seconds life(const std::string& text) {
  constexpr double longest = 3650.0 * 86'400;
  const auto seconds = seconds_of_text(text);
  const bool has_unit = !text.empty() && std::isalpha(static_cast<unsigned char>(text.back())) != 0;
  if (!seconds || !has_unit || *seconds < 1 || *seconds > longest)
    throw Failure(Exit::usage, "--expires " + text + ": a number with d, h, m or s, 1s to 3650d", "--expires 90d");
  return std::chrono::seconds(std::llround(*seconds));
}

// A file that is this user's alone, with the token; gone again unless it is kept.
class SecretFile {
 public:
  SecretFile(const std::string& path, const std::string& content) : path_(path) {
    const OpenFile file(path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW, 0600);
    if (file.get() < 0) {
      throw Failure(
          Exit::usage,
          "--out " + path + ": " + (errno == EEXIST ? "is there already, and is not written over" : std::strerror(errno)),
          "name a file that is not there yet");
    }
    const bool written =
        ::write(file.get(), content.data(), content.size()) == static_cast<ssize_t>(content.size()) && ::fsync(file.get()) == 0;
    if (written) return;
    const int error = errno;
    ::unlink(path.c_str());
    throw Failure(Exit::limit, "--out " + path + " cannot be written: " + std::strerror(error));
  }
  ~SecretFile() {
    if (!kept_) ::unlink(path_.c_str());
  }
  SecretFile(const SecretFile&) = delete;
  SecretFile& operator=(const SecretFile&) = delete;
  void keep() { kept_ = true; }

 private:
  const std::string path_;
  bool kept_ = false;
};

Table table_of(const google::protobuf::RepeatedPtrField<v1::Token>& tokens) {
  Table table({"id", "owner", "scope", "created", "expires", "state"});
  for (const auto& token : tokens) {
    table.add({token.id(), token.owner(), v1::Scope_Name(token.scope()), time_text(token.created_unix_nanos()),
               time_text(token.expires_unix_nanos()), token.expires_unix_nanos() > now_nanos() ? "good" : "expired"});
  }
  return table;
}

Exit create(const Program& program, const TokenOptions& options) {
  const auto text = new_token();
  v1::CreateTokenRequest request;
  auto& token = *request.mutable_token();
  token.set_id(text.id);
  token.set_owner(options.owner);
  token.set_scope(options.scope == "admin" ? v1::ADMIN : options.scope == "submit" ? v1::SUBMIT : v1::READ);
  token.set_secret_sha256(sha256(text.secret));
  token.set_expires_unix_nanos(now_nanos() + std::chrono::nanoseconds(life(options.expires)).count());
  const Connection connection(program.server);
  SecretFile file(options.out, text.text() + "\n");
  const auto made = connection.call(&Stub::CreateToken, request);
  file.keep();
  google::protobuf::RepeatedPtrField<v1::Token> one;
  *one.Add() = made;
  print_message(made, table_of(one), options.format);
  say("the secret is in " + options.out + ", and nowhere else: hand it over, then remove it");
  say("its holder: bedflow context add NAME --server HOST:PORT --ca FILE --token FILE");
  return Exit::ok;
}

Exit list(const Program& program, const TokenOptions& options) {
  const auto all = Connection(program.server).call(&Stub::ListTokens, v1::ListTokensRequest());
  if (all.tokens_size() == 0) say("no tokens; make one with: bedflow server token create OWNER --out FILE");
  if (all.tokens_size() > 0 || options.format != Format::table) print_message(all, table_of(all.tokens()), options.format);
  return Exit::ok;
}

Exit revoke(const Program& program, const TokenOptions& options) {
  if (options.id.empty() == options.owner.empty())
    throw Failure(Exit::usage, "revoke takes the id of a token, or --owner", "bedflow server token list");
  v1::RevokeTokenRequest request;
  if (!options.id.empty()) request.set_id(options.id);
  if (!options.owner.empty()) request.set_owner(options.owner);
  const auto gone = Connection(program.server).call(&Stub::RevokeToken, request);
  for (const auto& token : gone.tokens()) say("the token " + token.id() + " of " + token.owner() + " is revoked; its jobs stay");
  return Exit::ok;
}

}  // namespace

void add_token_verbs(CLI::App* server, Program& program) {
  auto* token = server->add_subcommand("token", "who may use the server from beyond the machine");
  token->require_subcommand(1);
  const auto verb = [&](const char* name, const char* meaning, Exit (*function)(const Program&, const TokenOptions&)) {
    auto options = std::make_shared<TokenOptions>();
    auto* made = token->add_subcommand(name, meaning);
    on_call(made, program, options, function);
    return std::pair(made, options);
  };
  const auto [creates, created] = verb("create", "let somebody in", create);
  creates->add_option("owner", created->owner, "whose jobs it makes and may act on: a-z 0-9 . _ -")->required();
  creates->add_option("--scope", created->scope, "read: look at all jobs; submit: and make and steer own ones; admin: steer all")
      ->check(CLI::IsMember({"read", "submit", "admin"}).description(""))
      ->type_name("SCOPE")
      ->required();
  creates->add_option("--expires", created->expires, "how long it holds")->type_name("90d|12h|30m|45s")->capture_default_str();
  creates->add_option("--out", created->out, "file for the secret, made with mode 0600")->type_name("FILE")->required();
  add_format(creates, created->format);
  const auto [lists, listed] = verb("list", "list the tokens; nobody can list their secrets", list);
  add_format(lists, listed->format);
  const auto [revokes, revoked] = verb("revoke", "shut somebody out, at once", revoke);
  revokes->add_option("id", revoked->id, "of the token");
  revokes->add_option("--owner", revoked->owner, "all tokens of an owner")->type_name("OWNER");
}

}  // namespace bedflow::client
