// server info; server token: token_verbs.cpp.
#include "connection.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct InfoOptions {
  Format format = Format::table;
};

Exit server_info(const Program& program, const InfoOptions& options) {
  const Connection connection(program.server);
  const auto info = connection.call(&Stub::GetServerInfo, v1::GetServerInfoRequest());
  Table table({"property", "value"});
  const auto joined = [](const auto& names) {
    std::string text;
    for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
  };
  table.add({"version", info.version()});
  table.add({"address", info.address().empty() ? connection.address() : info.address()});
  if (info.has_caller()) table.add({"you are", info.caller() + ", " + v1::Scope_Name(info.caller_scope())});
  table.add({"executors", joined(info.executors())});
  table.add({"ranks in use", std::to_string(info.ranks_in_use()) + " of " + std::to_string(info.slots())});
  table.add({"jobs running", std::to_string(info.jobs_running())});
  table.add({"jobs pending", std::to_string(info.jobs_pending())});
  table.add({"disk free", bytes_text(static_cast<double>(info.disk_free_bytes()))});
  for (const auto& law : info.built_laws()) table.add({"model", law});
  print_message(info, table, options.format);
  return Exit::ok;
}

}  // namespace

void add_server_verbs(CLI::App& app, Program& program) {
  auto* server = app.add_subcommand("server", "the server itself");
  server->require_subcommand(1);
  const auto info_options = std::make_shared<InfoOptions>();
  auto* verb = server->add_subcommand("info", "version, models, slots, queue, disk");
  add_format(verb, info_options->format);
  on_call(verb, program, info_options, server_info);
  add_token_verbs(server, program);
}

}  // namespace bedflow::client
