// The servers that this user knows, by name: $XDG_CONFIG_HOME/bedflow/contexts.txtpb (context.proto). And what is taken from the
// files that a context names.
#pragma once

#include <filesystem>
#include <string>

#include "bedflow/v1/context.pb.h"

namespace bedflow::client {

// $XDG_CONFIG_HOME/bedflow/contexts.txtpb, or below ~/.config.
std::filesystem::path contexts_file();

v1::Contexts read_contexts();                       // none when there is no file; throws Failure for one that is damaged
void write_contexts(const v1::Contexts& contexts);  // in the place of those before; throws Failure
const v1::Context& find_context(const v1::Contexts& contexts, const std::string& name);  // throws Failure(not_found)

// The server that a command is for: --server or --context if given, else BEDFLOW_CONTEXT or BEDFLOW_SERVER, else the context in
// use, else the socket of this user's own bedflowd.
struct ServerChoice {
  std::string address, context;  // of the options; empty: not given

  v1::Context resolve() const;  // throws Failure
  std::string words() const;    // what must be said to come to the same server again: " --context NAME", or nothing
};

// Whether the way there is the machine itself: a Unix socket or a loopback address.
bool is_near(const std::string& address);
// Whether it is taken over TLS: whenever it leaves the machine, or the context has something for TLS.
bool wants_tls(const v1::Context& context);

// The whole of a file that TLS needs. A private key that others may read is refused. Throws Failure.
std::string read_pem(const std::string& path, bool is_private);
// The token of a file that nobody else may read. Throws Failure.
std::string read_token_file(const std::string& path);

}  // namespace bedflow::client
