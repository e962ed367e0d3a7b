// server info.
#include "connection.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct InfoOptions {
  Format format = Format::table;
};

Exit server_info(const Program& program, const InfoOptions& options) {
  const auto info = Connection(program.server).call(&Stub::GetServerInfo, v1::GetServerInfoRequest());
  Table table({"property", "value"});
  const auto joined = [](const auto& names) {
    std::string text;
    for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
  };
  table.add({"version", info.version()});
  table.add({"address", info.address().empty() ? program.server : info.address()});
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
}

}  // namespace bedflow::client
