#include "command_line.h"

namespace bedflow::client {

void add_format(CLI::App* verb, Format& format) {
  static const std::map<std::string, Format> names = {
      {"table", Format::table}, {"json", Format::json}, {"jsonl", Format::jsonl}, {"csv", Format::csv}};
  verb->add_option("-o,--output", format, "table, json, jsonl or csv")
      ->transform(CLI::CheckedTransformer(names).description(""))
      ->type_name("FORMAT")
      ->default_str("table");
}

namespace {

constexpr const char* footer =
    "A first bed:   bedflow run mueller --ranks 2 --end 0.5\n"
    "An own case:   bedflow init mueller > case.txtpb, edit, bedflow validate case.txtpb, bedflow run case.txtpb\n"
    "Exit codes:    0 ok, 1 other, 2 usage or invalid case, 3 job failed, 4 not allowed, 5 not found, 6 wrong state,\n"
    "               7 server unreachable, 8 timed out, 9 limit, quota or disk, 10 cancelled, 11 data corrupt, 130 interrupted";

}  // namespace

std::unique_ptr<CLI::App> command_line(Program& program) {
  auto made = std::make_unique<CLI::App>("bedflow: CFD-DEM of particle beds as a service", "bedflow");
  CLI::App& app = *made;
  app.set_version_flag("--version", "bedflow " BEDFLOW_VERSION);
  app.footer(footer);
  app.require_subcommand(1);
  app.fallthrough();
  app.get_formatter()->column_width(34);
  app.add_option("--server", program.server.address, "address of the server, unix:PATH or HOST:PORT; or BEDFLOW_SERVER")
      ->type_name("ADDRESS")
      ->default_str("the socket of bedflowd");
  app.add_option("--context", program.server.context, "a server by name, see `bedflow context`; or BEDFLOW_CONTEXT")
      ->type_name("NAME")
      ->default_str("the one in use");
  add_run_verb(app, program);
  add_case_verbs(app, program);
  add_job_verbs(app, program);
  add_watch_verbs(app, program);
  add_result_verbs(app, program);
  add_field_verbs(app, program);
  add_checkpoint_verbs(app, program);
  add_study_verbs(app, program);
  add_reproduce_verb(app, program);
  add_server_verbs(app, program);
  add_context_verbs(app, program);
  add_top_verb(app, program);
  add_completion_verbs(app, program);
  return made;
}

}  // namespace bedflow::client
