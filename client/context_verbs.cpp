// context add, list, use, show, remove: the servers that one works with, by name.
#include <algorithm>

#include "contexts.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct ContextOptions {
  std::string name, server, ca, certificate, key, token;
  bool use = false;
  Format format = Format::table;
};

std::string absolute(const std::string& path) {
  return std::filesystem::absolute(path).lexically_normal();
}

void require_sound(const v1::Context& context) {
  const bool is_name =
      !context.name().empty() && context.name().size() <= 63 &&
      context.name().find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-") == std::string::npos;
  if (!is_name) throw Failure(Exit::usage, "\"" + context.name() + "\" is no name: letters, digits, . _ - are, at most 63");
  const std::string& address = context.server();
  const bool has_port = address.find(':') != std::string::npos && !address.ends_with(':');
  if (!has_port) throw Failure(Exit::usage, "--server " + address + " is no address", "unix:PATH or HOST:PORT");
  if (address.starts_with("unix:") && wants_tls(context))
    throw Failure(Exit::usage, "a Unix socket takes neither certificates nor a token: who can open it is its owner");
  if (context.has_certificate() != context.has_key()) throw Failure(Exit::usage, "--certificate and --key come together");
  if (context.has_ca()) read_pem(context.ca(), false);
  if (context.has_certificate()) read_pem(context.certificate(), false);
  if (context.has_key()) read_pem(context.key(), true);
  if (context.has_token()) read_token_file(context.token());
}

Exit add(const Program&, const ContextOptions& options) {
  v1::Context context;
  context.set_name(options.name);
  context.set_server(options.server.starts_with("unix:") ? "unix:" + absolute(options.server.substr(5)) : options.server);
  if (!options.ca.empty()) context.set_ca(absolute(options.ca));
  if (!options.certificate.empty()) context.set_certificate(absolute(options.certificate));
  if (!options.key.empty()) context.set_key(absolute(options.key));
  if (!options.token.empty()) context.set_token(absolute(options.token));
  require_sound(context);
  auto contexts = read_contexts();
  auto& all = *contexts.mutable_contexts();
  const auto same = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name() == options.name; });
  const bool is_new = same == all.end();
  (is_new ? *all.Add() : *same) = context;
  if (options.use || all.size() == 1) contexts.set_current(options.name);
  write_contexts(contexts);
  say("context " + options.name + (is_new ? " is added" : " is changed") +
      (contexts.current() == options.name ? ", and in use" : "; to use it: bedflow context use " + options.name));
  if (!is_near(context.server()) && !context.has_token())
    say("it has no token: a server beyond this machine asks for one (--token FILE)");
  return Exit::ok;
}

Table table_of(const v1::Contexts& contexts) {
  Table table({"name", "in_use", "server", "ca", "certificate", "token"});
  for (const auto& one : contexts.contexts())
    table.add({one.name(), one.name() == contexts.current(), one.server(), one.ca(), one.certificate(), one.token()});
  return table;
}

Exit list(const Program&, const ContextOptions& options) {
  const auto contexts = read_contexts();
  if (contexts.contexts_size() == 0) say("no contexts; add one with: bedflow context add NAME --server ADDRESS");
  if (contexts.contexts_size() > 0 || options.format != Format::table)
    print_message(contexts, table_of(contexts), options.format);
  return Exit::ok;
}

Exit use(const Program&, const ContextOptions& options) {
  auto contexts = read_contexts();
  find_context(contexts, options.name);
  contexts.set_current(options.name);
  write_contexts(contexts);
  say("context " + options.name + " is in use");
  return Exit::ok;
}

Exit show(const Program&, const ContextOptions& options) {
  const auto contexts = read_contexts();
  if (options.name.empty() && contexts.current().empty())
    throw Failure(Exit::not_found, "no context is in use", "bedflow context use NAME; bedflow context list");
  const auto& context = find_context(contexts, options.name.empty() ? contexts.current() : options.name);
  Table table({"property", "value"});
  table.add({"name", context.name()});
  table.add({"in use", context.name() == contexts.current() ? "yes" : "no"});
  table.add({"server", context.server()});
  table.add({"TLS", wants_tls(context) ? "yes" : "no"});
  if (wants_tls(context)) {
    table.add({"authorities", context.has_ca() ? context.ca() : "the system's"});
    table.add({"own certificate", context.has_certificate() ? context.certificate() : "none"});
    table.add({"own key", context.has_key() ? context.key() : "none"});
    table.add({"token file", context.has_token() ? context.token() : "none"});
  }
  print_message(context, table, options.format);
  require_sound(context);
  return Exit::ok;
}

Exit remove(const Program&, const ContextOptions& options) {
  auto contexts = read_contexts();
  find_context(contexts, options.name);
  auto& all = *contexts.mutable_contexts();
  all.erase(std::remove_if(all.begin(), all.end(), [&](const auto& one) { return one.name() == options.name; }), all.end());
  const bool was_in_use = contexts.current() == options.name;
  if (was_in_use) contexts.clear_current();
  write_contexts(contexts);
  say("context " + options.name + " is removed; the files that it named are not" + (was_in_use ? "; none is in use now" : ""));
  return Exit::ok;
}

}  // namespace

void add_context_verbs(CLI::App& app, Program& program) {
  auto* context = app.add_subcommand("context", "the servers that you work with, by name");
  context->require_subcommand(1);
  const auto verb = [&](const char* name, const char* meaning, Exit (*function)(const Program&, const ContextOptions&)) {
    auto options = std::make_shared<ContextOptions>();
    auto* made = context->add_subcommand(name, meaning);
    on_call(made, program, options, function);
    return std::pair(made, options);
  };
  const auto [adds, added] = verb("add", "add a server, or change it", add);
  adds->add_option("name", added->name)->required();
  adds->add_option("--server", added->server, "unix:PATH or HOST:PORT; TLS beyond this machine")
      ->required()
      ->type_name("ADDRESS");
  adds->add_option("--ca", added->ca, "authorities that may vouch for the server, PEM; the system's if absent")
      ->type_name("FILE");
  adds->add_option("--certificate", added->certificate, "your own, for servers that ask for one, PEM")->type_name("FILE");
  adds->add_option("--key", added->key, "its private key, PEM; readable by you alone")->type_name("FILE");
  adds->add_option("--token", added->token, "file with your token; readable by you alone")->type_name("FILE");
  adds->add_flag("--use", added->use, "use it from now on");
  const auto [lists, listed] = verb("list", "list the servers", list);
  add_format(lists, listed->format);
  const auto [uses, used] = verb("use", "send commands there from now on", use);
  uses->add_option("name", used->name)->required();
  const auto [shows, shown] = verb("show", "show a server, and check its files", show);
  shows->add_option("name", shown->name, "the one in use if absent");
  add_format(shows, shown->format);
  const auto [removes, removed] = verb("remove", "forget a server", remove);
  removes->add_option("name", removed->name)->required();
}

}  // namespace bedflow::client
