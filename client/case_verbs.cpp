// init, validate, reference, explain: everything about a case before it is a job. None needs a server.
#include <google/protobuf/text_format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "bedflow/v1/results.pb.h"
#include "case_difference.h"
#include "case_source.h"
#include "cases/ready_cases.h"
#include "child.h"
#include "parameter_lines.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct InitOptions {
  std::string name, preset;
  std::vector<std::string> set;
  Format format = Format::table;
};

Exit list_ready_cases(Format format) {
  Table table({"name", "description"});
  for (const auto& one : ready_cases()) table.add({std::string(one.name), std::string(one.description)});
  print_data(table.text(format));
  if (format == Format::table) {
    Table presets({"preset", "description"});
    for (const auto& one : ready_presets()) presets.add({std::string(one.name), std::string(one.description)});
    print_data("\n" + presets.text(format));
  }
  say("\nprint one with: bedflow init NAME [--preset P] > case.txtpb");
  return Exit::ok;
}

Exit init(const Program&, const InitOptions& options) {
  if (options.name.empty()) return list_ready_cases(options.format);
  const auto ready = ready_cases();
  const auto found = std::find_if(ready.begin(), ready.end(), [&](const auto& one) { return one.name == options.name; });
  if (found == ready.end()) {
    throw Failure(Exit::usage, "there is no ready case \"" + options.name + "\"; there are " + ready_case_names(),
                  "bedflow init");
  }
  const bool as_written = options.preset.empty() && options.set.empty() && options.format != Format::json;
  if (as_written) {  // with its comments
    print_data(ready_case_text(options.name));
    return Exit::ok;
  }
  const auto presets = ready_presets();
  const bool known = std::any_of(presets.begin(), presets.end(), [&](const auto& one) { return one.name == options.preset; });
  if (!options.preset.empty() && !known)
    throw Failure(Exit::usage, "there is no preset \"" + options.preset + "\"", "the presets: bedflow init");
  auto value = ready_case(options.name, options.preset);
  for (const auto& assignment : options.set) set_value(value, assignment);
  print_data(options.format == Format::json || options.format == Format::jsonl ? case_json(value) : case_text(value));
  const auto faults = check_case(value);
  if (faults.empty()) return Exit::ok;
  throw Failure(Exit::usage, "the case is printed, but it does not run as it is:", "bedflow reference", faults);
}

struct CaseOptions {
  std::string where;
  std::vector<std::string> set;
  std::string diff;
  std::uint32_t ranks = 1;
  Format format = Format::table;
};

Exit validate(const Program&, const CaseOptions& options) {
  const Terminal terminal(stderr);
  try {
    const auto value = load_case(options.where, options.set);
    if (options.format != Format::table) print_data(Table({"path", "fault"}).text(options.format));
    say(terminal.paint(Colour::green, "ok: ") + "the case \"" + value.name() + "\" has no faults; next: bedflow explain " +
        options.where);
    return Exit::ok;
  } catch (const Failure& failure) {
    if (options.format == Format::table || failure.faults.empty()) throw;
    Table table({"path", "fault"});
    for (const auto& fault : failure.faults) table.add({fault.path, fault.text});
    print_data(table.text(options.format));
    return failure.code;
  }
}

// A file of our own that is gone afterwards.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text) {
    path_ = (std::filesystem::temp_directory_path() / "bedflow-XXXXXX.txtpb").string();
    const int file = mkstemps(path_.data(), 6);
    if (file < 0) throw std::system_error(errno, std::generic_category(), path_);
    close(file);
    if (!(std::ofstream(path_) << text).flush())
      throw Failure(Exit::limit, "the file " + path_ + " cannot be written: is the disk full?");
  }
  ~TemporaryFile() { unlink(path_.c_str()); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

Exit explain_difference(const CaseOptions& options) {
  Table table({"parameter", options.diff, options.where});
  const auto found = differences(load_case(options.diff, options.set), load_case(options.where, options.set));
  for (const auto& one : found) table.add({one.path, one.first, one.second});
  if (!found.empty() || options.format != Format::table) print_data(table.text(options.format));
  if (found.empty()) say("the two cases are the same model");
  return Exit::ok;
}

Exit explain(const Program&, const CaseOptions& options) {
  if (!options.diff.empty()) return explain_difference(options);
  const auto value = load_case(options.where, options.set);
  const auto engine = beside_own_executable("bedflow-engine");
  const TemporaryFile file(case_text(value));
  const auto result = run_child({engine.string(), "--plan", file.path(), "--ranks", std::to_string(options.ranks)});
  v1::PlanReport report;
  if (result.exit_code != 0 || !google::protobuf::TextFormat::ParseFromString(result.out, &report)) {
    const auto code = result.exit_code == v1::INVALID_CASE ? Exit::usage : Exit::other;
    throw Failure(
        code,
        "the case cannot be planned: " + (result.error.empty() ? "exit code " + std::to_string(result.exit_code) : result.error),
        "bedflow validate " + options.where);
  }
  if (options.format == Format::table) {
    print_data(report.text().ends_with('\n') ? report.text() : report.text() + "\n");
    return Exit::ok;
  }
  Table table({"part", "on", "why"});
  for (const auto& item : report.items()) table.add({item.part(), item.on(), item.why()});
  print_message(report, table, options.format);
  return Exit::ok;
}

struct ReferenceOptions {
  Format format = Format::table;
};

Exit reference(const Program&, const ReferenceOptions& options) {
  if (options.format == Format::table) {
    print_data(parameter_reference());
    return Exit::ok;
  }
  Table table({"block", "field", "type", "unit", "default", "allowed", "meaning"});
  for (const auto& one : parameter_lines())
    table.add({one.block, one.field, one.type, one.unit, one.otherwise, one.allowed, one.meaning});
  print_data(table.text(options.format));
  return Exit::ok;
}

}  // namespace

void add_case_verbs(CLI::App& app, Program& program) {
  const auto init_options = std::make_shared<InitOptions>();
  auto* verb = app.add_subcommand("init", "print a ready case to start from; without a name, list them");
  verb->add_option("name", init_options->name, "ready case");
  verb->add_option("--preset", init_options->preset, "set of models, such as mfix-exa-2018");
  verb->add_option("--set", init_options->set, "change a parameter, as in particles.random.count=1000")->type_name("PATH=VALUE");
  add_format(verb, init_options->format);
  on_call(verb, program, init_options, init);

  const auto check_options = std::make_shared<CaseOptions>();
  verb = app.add_subcommand("validate", "check a case: every fault with its path");
  verb->add_option("case", check_options->where, "file, - for stdin, or a ready case")->required();
  verb->add_option("--set", check_options->set, "change a parameter first")->type_name("PATH=VALUE");
  add_format(verb, check_options->format);
  on_call(verb, program, check_options, validate);

  verb = app.add_subcommand("reference", "print the reference of all parameters: meaning, unit, bounds, default");
  const auto reference_options = std::make_shared<ReferenceOptions>();
  add_format(verb, reference_options->format);
  on_call(verb, program, reference_options, reference);

  const auto plan_options = std::make_shared<CaseOptions>();
  verb = app.add_subcommand("explain", "print what a case requires: what is on and why, steps, cells, memory, time");
  verb->add_option("case", plan_options->where, "file, - for stdin, or a ready case, with a preset as in mueller@bedflow")
      ->required();
  verb->add_option("--set", plan_options->set, "change a parameter first")->type_name("PATH=VALUE");
  verb->add_option("--diff", plan_options->diff,
                   "instead: in what models another case differs, as in --diff mueller mueller@bedflow")
      ->type_name("CASE");
  verb->add_option("--ranks", plan_options->ranks, "ranks to plan for")->check(CLI::Range(1, 100000))->capture_default_str();
  add_format(verb, plan_options->format);
  on_call(verb, program, plan_options, explain);
}

}  // namespace bedflow::client
