// server info, server usage; server token: token_verbs.cpp.
#include "connection.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct InfoOptions {
  Format format = Format::table;
};

// "3 of 4 slots, 1.2 of 8 GB by plans"; of a batch system how many of its jobs run and wait.
std::string executor_text(const v1::ExecutorInfo& info) {
  std::string text;
  if (info.name() == "local") {
    text = std::to_string(info.ranks_in_use()) + " of " + std::to_string(info.slots()) + " slots in use";
  } else {
    text = std::to_string(info.jobs_running()) + " running, " + std::to_string(info.jobs_queued()) + " in its queue, " +
           std::to_string(info.ranks_in_use()) + " ranks; at most " + std::to_string(info.slots()) + " a job";
  }
  if (info.memory_bytes() > 0) {
    text += ", " + bytes_text(info.memory_in_use()) + " of " + bytes_text(info.memory_bytes()) + " by plans";
  }
  if (!info.trouble().empty()) text += "; it does not answer: " + info.trouble();
  return text;
}

std::string queued_text(const v1::QueuedJob& job) {
  std::string text =
      job.id() + " " + job.case_name() + ", " + std::to_string(job.ranks()) + (job.ranks() == 1 ? " rank" : " ranks");
  if (job.priority() != 0) text += ", priority " + std::to_string(job.priority());
  if (job.executor() != "local") text += ", " + job.executor();
  if (!job.waits_for().empty()) text += "; waits for " + job.waits_for();
  return text;
}

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
  for (const auto& executor : info.executor_infos()) table.add({executor.name(), executor_text(executor)});
  table.add({"jobs running", std::to_string(info.jobs_running())});
  table.add({"jobs pending", std::to_string(info.jobs_pending())});
  for (const auto& job : info.queue()) table.add({"next", queued_text(job)});
  table.add({"disk free", bytes_text(info.disk_free_bytes())});
  for (const auto& law : info.built_laws()) table.add({"model", law});
  print_message(info, table, options.format);
  return Exit::ok;
}

struct UsageOptions {
  std::string owner;
  std::uint32_t most = 20;
  bool by_owner = false;
  Format format = Format::table;
};

// "3 of 10"; the number alone without a limit.
template <class Number>
std::string of_limit(const Number& now, bool is_limited, const Number& limit) {
  return is_limited ? now + " of " + limit : now;
}

Table totals(const v1::Usage& usage) {
  const auto& quota = usage.quota();
  Table table({"property", "value"});
  table.add({"jobs kept", of_limit(std::to_string(usage.jobs_kept()), quota.has_jobs(), std::to_string(quota.jobs()))});
  table.add(
      {"jobs running", of_limit(std::to_string(usage.jobs_running()), quota.has_running(), std::to_string(quota.running()))});
  table.add({"jobs waiting", std::to_string(usage.jobs_pending())});
  table.add({"ranks in use", std::to_string(usage.ranks_in_use()) + " of " + std::to_string(usage.slots())});
  table.add({"memory in use", bytes_text(usage.memory_bytes())});
  table.add({"disk in use", of_limit(bytes_text(usage.disk_bytes()), quota.has_bytes(), bytes_text(quota.bytes()))});
  table.add({"disk free", bytes_text(usage.disk_free_bytes()) +
                              (usage.disk_reserve_bytes() > 0 ? "; reserve " + bytes_text(usage.disk_reserve_bytes()) : "")});
  table.add({"CPU hours", number_text(usage.rank_seconds() / 3600)});
  if (usage.removed_jobs() + usage.removed_checkpoints() > 0) {
    table.add({"removed by retention", std::to_string(usage.removed_jobs()) + " jobs, " +
                                           std::to_string(usage.removed_checkpoints()) + " checkpoints, " +
                                           bytes_text(usage.removed_bytes())});
  }
  return table;
}

// Sizes for people have units, those for programs are bytes.
Cell size_cell(std::uint64_t bytes, Format format) {
  if (format == Format::table) return bytes_text(bytes);
  return bytes;
}

Table owners(const v1::Usage& usage, Format format) {
  Table table({"owner", "jobs", "running", "disk", "cpu_hours", "memory", "quota"});
  for (const auto& one : usage.owners()) {
    std::string quota;
    const auto add = [&](bool has, const std::string& text) {
      if (has) quota += (quota.empty() ? "" : ", ") + text;
    };
    add(one.quota().has_jobs(), std::to_string(one.quota().jobs()) + " jobs");
    add(one.quota().has_running(), std::to_string(one.quota().running()) + " running");
    add(one.quota().has_bytes(), bytes_text(one.quota().bytes()));
    table.add({one.owner(), std::uint64_t{one.jobs()}, std::uint64_t{one.running()}, size_cell(one.bytes(), format),
               one.rank_seconds() / 3600, size_cell(one.memory_bytes(), format), quota.empty() ? Cell() : Cell(quota)});
  }
  return table;
}

Table jobs(const v1::Usage& usage, Format format) {
  Table table({"job", "owner", "case", "state", "disk", "checkpoints", "in_checkpoints", "cpu_hours", "memory", "pinned"});
  for (const auto& one : usage.jobs()) {
    table.add({one.id(), one.owner(), one.case_name(), state_name(one.state()), size_cell(one.bytes(), format),
               std::uint64_t{one.checkpoints()}, size_cell(one.checkpoint_bytes(), format), one.rank_seconds() / 3600,
               one.has_memory_bytes() ? size_cell(one.memory_bytes(), format) : Cell(),
               format == Format::table && !one.pinned() ? Cell() : Cell(one.pinned())});
  }
  return table;
}

Exit server_usage(const Program& program, const UsageOptions& options) {
  v1::GetUsageRequest request;
  request.set_most(options.most);
  if (!options.owner.empty()) request.set_owner(options.owner);
  const auto usage = Connection(program.server).call(&Stub::GetUsage, request, 60);
  if (options.format != Format::table) {
    print_message(usage, options.by_owner ? owners(usage, options.format) : jobs(usage, options.format), options.format);
    return Exit::ok;
  }
  std::string text = totals(usage).text(Format::table);
  if (usage.owners_size() > 0) text += "\n" + owners(usage, Format::table).text(Format::table);
  if (usage.jobs_size() > 0 && !options.by_owner) text += "\n" + jobs(usage, Format::table).text(Format::table);
  print_data(text);
  if (!options.by_owner && options.owner.empty() && usage.jobs_kept() > options.most)
    say("the " + std::to_string(options.most) + " largest jobs of " + std::to_string(usage.jobs_kept()) + "; --most shows more");
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

  const auto usage_options = std::make_shared<UsageOptions>();
  verb = server->add_subcommand("usage", "disk, checkpoints, CPU hours and memory, by job and by owner; quotas and queue");
  verb->add_option("--owner", usage_options->owner, "of this owner alone");
  verb->add_option("--most", usage_options->most, "at most so many jobs, the largest first")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  verb->add_flag("--by-owner", usage_options->by_owner, "the owners alone");
  add_format(verb, usage_options->format);
  on_call(verb, program, usage_options, server_usage);
  add_token_verbs(server, program);
}

}  // namespace bedflow::client
