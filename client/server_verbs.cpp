// checkpoint list and create, server info.
#include "connection.h"
#include "job_table.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct CheckpointOptions {
  std::string job;
  double timeout = 60;
  Format format = Format::table;
};

Exit list_checkpoints(const Program& program, const CheckpointOptions& options) {
  v1::ListCheckpointsRequest request;
  request.set_id(options.job);
  const auto response = Connection(program.server).call(&Stub::ListCheckpoints, request);
  const std::vector<v1::Checkpoint> all(response.checkpoints().begin(), response.checkpoints().end());
  if (all.empty()) say("no checkpoints yet; write one with: bedflow checkpoint create " + options.job);
  if (!all.empty() || options.format != Format::table) print_messages(pointers(all), table_of(all), options.format);
  return Exit::ok;
}

Exit create_checkpoint(const Program& program, const CheckpointOptions& options) {
  v1::CreateCheckpointRequest request;
  request.set_id(options.job);
  request.set_timeout_seconds(options.timeout);
  const auto checkpoint = Connection(program.server).call(&Stub::CreateCheckpoint, request, options.timeout + 10);
  print_message(checkpoint, table_of(std::vector{checkpoint}), options.format);
  return Exit::ok;
}

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
  auto* checkpoint = app.add_subcommand("checkpoint", "checkpoints of a job");
  checkpoint->require_subcommand(1);
  const auto list_options = std::make_shared<CheckpointOptions>();
  auto* verb = checkpoint->add_subcommand("list", "list them, newest first");
  verb->add_option("job", list_options->job, "id of the job")->required();
  add_format(verb, list_options->format);
  on_call(verb, program, list_options, list_checkpoints);

  const auto create_options = std::make_shared<CheckpointOptions>();
  verb = checkpoint->add_subcommand("create", "write one now; the job goes on");
  verb->add_option("job", create_options->job, "id of the job")->required();
  verb->add_option("--timeout", create_options->timeout, "wait for it at most so long, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_format(verb, create_options->format);
  on_call(verb, program, create_options, create_checkpoint);

  auto* server = app.add_subcommand("server", "the server itself");
  server->require_subcommand(1);
  const auto info_options = std::make_shared<InfoOptions>();
  verb = server->add_subcommand("info", "version, models, slots, queue, disk");
  add_format(verb, info_options->format);
  on_call(verb, program, info_options, server_info);
}

}  // namespace bedflow::client
