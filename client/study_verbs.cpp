// study: runs of one case that differ in what is varied, compared in cost and in what they say.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>

#include "case_source.h"
#include "embedded_server.h"
#include "gnuplot.h"
#include "interrupt.h"
#include "job_request.h"
#include "study_follow.h"
#include "study_page.h"
#include "terminal.h"
#include "vary.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

using namespace std::chrono_literals;

struct StudyOptions : JobOptions {
  std::vector<std::string> vary, quantities, reference;
  std::string name, data, plot, page;
  std::optional<double> from, bin, interval;
  bool grid = false, own_packings = false, anew = false, knobs = false;
  Format format = Format::table;
};

// ------------------------------------------------------------------------------------------------ what is asked

// Of each axis the index of its reference value.
std::vector<std::size_t> reference_of(const std::vector<Axis>& axes, const std::vector<std::string>& wanted) {
  std::vector<std::optional<std::size_t>> chosen(axes.size());
  for (const auto& text : wanted) {
    if (text == "finest") continue;
    const auto equals = text.find('=');
    const auto axis = std::ranges::find(axes, text.substr(0, equals), &Axis::name);
    if (equals == text.npos || axis == axes.end()) {
      throw Failure(Exit::usage, "--reference " + text + ": neither finest nor AXIS=VALUE of an axis that --vary names");
    }
    const auto value = std::ranges::find(axis->values, text.substr(equals + 1));
    if (value == axis->values.end()) throw Failure(Exit::usage, "--reference " + text + ": --vary does not list that value");
    chosen[static_cast<std::size_t>(axis - axes.begin())] = static_cast<std::size_t>(value - axis->values.begin());
  }
  std::vector<std::size_t> reference;
  for (std::size_t a = 0; a < axes.size(); ++a) reference.push_back(chosen[a] ? *chosen[a] : finest(axes[a]));
  return reference;
}

// The points as indices of values: the reference first, then one axis at a time, or all combinations.
std::vector<std::vector<std::size_t>> points_of(const std::vector<Axis>& axes, const std::vector<std::size_t>& reference,
                                                bool grid) {
  std::vector<std::vector<std::size_t>> points = {reference};
  if (!grid) {
    for (std::size_t a = 0; a < axes.size(); ++a) {
      for (std::size_t v = 0; v < axes[a].values.size(); ++v) {
        if (v == reference[a]) continue;
        points.push_back(reference);
        points.back()[a] = v;
      }
    }
    return points;
  }
  std::vector<std::size_t> at(axes.size(), 0);
  while (true) {
    if (at != reference) points.push_back(at);
    std::size_t a = 0;
    while (a < axes.size() && ++at[a] == axes[a].values.size()) at[a++] = 0;
    if (a == axes.size()) return points;
  }
}

v1::StudyQuantity quantity_of(const std::string& text) {
  v1::StudyQuantity quantity;
  const auto colon = text.find(':');
  quantity.set_monitor(text.substr(0, colon));
  if (colon == text.npos) return quantity;
  if (text.substr(colon) != ":fluctuation")
    throw Failure(Exit::usage, "--quantity " + text + ": after the colon there can only be \"fluctuation\"");
  quantity.set_fluctuation(true);
  return quantity;
}

// Every quantity gets bins of time from --from on, as many as fit.
void set_averaging(v1::Case& value, const v1::StudySpec& spec, const StudyOptions& options) {
  for (const auto& quantity : spec.quantities()) {
    const auto monitor = std::ranges::find(*value.mutable_monitors(), quantity.monitor(), &v1::Monitor::name);
    if (monitor == value.mutable_monitors()->end()) {
      std::string names;
      for (const auto& one : value.monitors()) names += (names.empty() ? "" : ", ") + one.name();
      throw Failure(Exit::usage, "--quantity " + quantity.monitor() + ": the case has no such monitor; it has " + names);
    }
    if (!options.from && !options.bin && monitor->has_averaging()) continue;
    const double end = value.time().end(), from = options.from.value_or(0.2 * end), bin = options.bin.value_or((end - from) / 10);
    const double bins = std::floor((end - from) / bin + 1e-9);
    if (!(bins >= 2)) {
      throw Failure(Exit::usage,
                    "from " + number_text(from) + " s to the end at " + number_text(end) + " s there are " +
                        number_text(std::max(0.0, bins)) + " bins of " + number_text(bin) + " s; an interval needs 2",
                    "--end later, --from earlier or --bin shorter");
    }
    auto& averaging = *monitor->mutable_averaging();
    averaging.set_start(from);
    averaging.set_bin(bin);
    averaging.set_bins(static_cast<std::uint32_t>(bins));
  }
}

void require_sound(const v1::Case& value, const std::string& point) {
  auto faults = check_case(value);
  if (faults.empty()) return;
  throw Failure(Exit::usage, "the case of " + point + " has faults", "bedflow reference", std::move(faults));
}

// As it was typed, for the page: without what says where, and not what.
std::string command_of(const std::vector<std::string>& words) {
  std::string line = "bedflow";
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string name = words[i].substr(0, words[i].find('='));
    const bool says_where = name == "--data" || name == "--page" || name == "--plot" || name == "--server" || name == "--context";
    if (says_where) {
      i += name == words[i] ? 1 : 0;
      continue;
    }
    const bool is_plain = !words[i].empty() && words[i].find_first_of(" \t\n\"'\\$`*?[]{}()<>|&;#~!") == std::string::npos;
    line += is_plain ? " " + words[i] : " '" + words[i] + "'";
  }
  return line;
}

v1::StudySpec spec_of(const StudyOptions& options, const std::string& command) {
  if (options.vary.empty() || options.quantities.empty()) {
    throw Failure(
        Exit::usage,
        options.vary.empty() ? "--vary is missing: what is to differ?" : "--quantity is missing: what is to be compared?",
        "bedflow study mueller --vary substeps=1,5,20 --quantity bed_height --end 4");
  }
  v1::CreateJobRequest base = create_request(options);
  if (!base.case_().has_name()) base.mutable_case_()->set_name("study");
  v1::StudySpec spec;
  spec.set_name(options.name.empty() ? base.case_().name() : options.name);
  spec.set_command(command);
  *spec.mutable_job() = base.spec();
  if (options.interval) spec.mutable_stop()->set_relative(*options.interval / 100);
  if (options.own_packings) spec.set_same_packing(false);
  if (options.anew) spec.set_reuse(false);
  for (const auto& text : options.quantities) *spec.add_quantities() = quantity_of(text);
  std::vector<Axis> axes;
  for (const auto& text : options.vary) {
    axes.push_back(parse_axis(text));
    spec.add_axes(axes.back().name);
    v1::Case probe = base.case_();
    for (const auto& value : axes.back().values) vary(probe, axes.back().name, value);  // faults of what was typed come first
  }
  v1::Case plain = base.case_();
  plain.clear_output();  // no pictures of every run
  set_averaging(plain, spec, options);
  spec.set_reference(0);
  for (const auto& point : points_of(axes, reference_of(axes, options.reference), options.grid)) {
    auto& added = *spec.add_points();
    *added.mutable_case_() = plain;
    std::string name;
    for (std::size_t a = 0; a < axes.size(); ++a) {
      const auto& value = axes[a].values[point[a]];
      vary(*added.mutable_case_(), axes[a].name, value);
      added.add_values(value);
      name += (name.empty() ? "" : " ") + axes[a].name + "=" + value;
    }
    require_sound(added.case_(), name);
  }
  return spec;
}

// ------------------------------------------------------------------------------------------------ what it says

template <class Options>
void show(const v1::Study& study, const Options& options) {
  print_study(study, options.format);
  if (!options.plot.empty()) {
    draw_picture(study_plot(study, options.plot), options.plot);
    say("picture: " + options.plot);
  }
  if (!options.page.empty()) say("page: " + write_study_page(options.page, study).string());
}

Exit end_of(const v1::Study& study) {
  if (study.state() == v1::STUDY_CANCELLED) return Exit::cancelled;
  const bool failed = std::ranges::any_of(study.runs(), [](const auto& run) { return run.state() == v1::FAILED; });
  return failed ? Exit::job_failed : Exit::ok;
}

Exit begin(const Program& program, const StudyOptions& options) {
  if (options.knobs) {
    Table table({"knob", "path", "what"});
    for (const auto& knob : knobs()) table.add({knob.name, knob.path, knob.meaning});
    print_data(table.text(options.format));
    return Exit::ok;
  }
  if (options.where.empty())
    throw Failure(Exit::usage, "a case is missing", "bedflow study mueller --vary substeps=1,5,20 --quantity bed_height --end 4");
  Interrupt interrupt;
  v1::CreateStudyRequest request;
  *request.mutable_spec() = spec_of(options, command_of(program.words));
  request.set_request_id(new_request_id());
  std::unique_ptr<EmbeddedServer> own;
  if (!options.data.empty()) own = std::make_unique<EmbeddedServer>(options.data);
  const Connection connection(own ? ServerChoice{own->address(), ""} : program.server);
  const auto id = connection.call(&Stub::CreateStudy, request, 120).id();
  const std::string come_back = "bedflow study get " + id + (own ? " --server " + own->address() : program.server.words());
  say("study " + id + " of " + std::to_string(request.spec().points_size()) + " runs; come back: " + come_back);
  const auto study = follow_study(connection, id, interrupt, own.get());
  if (!study) {
    if (own) own->leave();
    say("\nthe study goes on; come back: " + come_back);
    return Exit::interrupted;
  }
  show(*study, options);
  return end_of(*study);
}

// ------------------------------------------------------------------------------------------------ those there are

struct OneStudyOptions {
  std::string study, plot, page;
  bool wait = false, with_jobs = false;
  Format format = Format::table;
};

Exit get(const Program& program, const OneStudyOptions& options) {
  const Connection connection(program.server);
  Interrupt interrupt;
  const auto study =
      options.wait ? follow_study(connection, options.study, interrupt, nullptr) : get_study(connection, options.study);
  if (!study) return Exit::interrupted;
  if (options.format == Format::table)
    say("study " + study->id() + " is " + study_state_name(study->state()) + ": " + progress_of(*study));
  show(*study, options);
  return options.wait ? end_of(*study) : Exit::ok;
}

Exit list(const Program& program, const OneStudyOptions& options) {
  const auto response = Connection(program.server).call(&Stub::ListStudies, v1::ListStudiesRequest());
  const std::vector<v1::Study> studies(response.studies().begin(), response.studies().end());
  const std::vector<const google::protobuf::Message*> messages(response.studies().pointer_begin(),
                                                               response.studies().pointer_end());
  if (studies.empty()) say("no studies; begin one with: bedflow study CASE --vary ... --quantity ...");
  if (!studies.empty() || options.format != Format::table) print_messages(messages, table_of(studies), options.format);
  return Exit::ok;
}

Exit cancel(const Program& program, const OneStudyOptions& options) {
  v1::CancelStudyRequest request;
  request.set_id(options.study);
  const auto study = Connection(program.server).call(&Stub::CancelStudy, request);
  say("study " + study.id() + " is cancelled; what its runs have said so far: bedflow study get " + study.id());
  return Exit::ok;
}

Exit remove(const Program& program, const OneStudyOptions& options) {
  v1::DeleteStudyRequest request;
  request.set_id(options.study);
  request.set_with_jobs(options.with_jobs);
  const auto response = Connection(program.server).call(&Stub::DeleteStudy, request, 120);
  say("study " + options.study + " is deleted; " + bytes_text(response.freed_bytes()) + " are free again" +
      (options.with_jobs ? "" : "; its jobs are still there"));
  return Exit::ok;
}

}  // namespace

void add_study_verbs(CLI::App& app, Program& program) {
  const auto options = std::make_shared<StudyOptions>();
  auto* study = app.add_subcommand("study", "what a parameter or a model does to cost and to results");
  study->require_subcommand(0, 1);
  study->add_option("case", options->where, "file, - for stdin, or a ready case");
  add_job_options(study, *options);
  study->add_option("--vary", options->vary, "what differs: a knob (--knobs), a parameter or a choice of laws, and its values")
      ->type_name("NAME=VALUE,VALUE,...");
  study->add_option("--quantity", options->quantities, "what is compared: a monitor's mean, or its fluctuation in time")
      ->type_name("MONITOR[:fluctuation]");
  study->add_option("--reference", options->reference, "what the others are compared with: finest, or a value of an axis")
      ->type_name("finest|NAME=VALUE")
      ->default_str("finest");
  study->add_flag("--grid", options->grid, "all combinations; otherwise one axis at a time, the others at the reference");
  study->add_option("--from", options->from, "averages begin here, s; as the case says, or after a fifth, if absent");
  study->add_option("--bin", options->bin, "bins of time for the intervals, s; as the case says, or ten, if absent")
      ->check(CLI::PositiveNumber);
  study->add_option("--interval", options->interval, "stop a run once all its half-widths are below so many % of the means")
      ->check(CLI::Range(0.0, 100.0));
  study->add_flag("--own-packings", options->own_packings,
                  "every run seeds and settles its own bed; otherwise all with the same particles start from one");
  study->add_flag("--anew", options->anew, "run again what an earlier job has run already");
  study->add_option("--name", options->name, "of the study; the case's if absent");
  study->add_option("--data", options->data, "on a server of its own that keeps its jobs in this folder, as run does");
  study->add_option("--plot", options->plot, "picture of cost against difference")->type_name("FILE.png");
  study->add_option("--page", options->page, "a page with tables and pictures, and the study as JSON, in this folder")
      ->type_name("FOLDER");
  study->add_flag("--knobs", options->knobs, "list what has a short name");
  add_format(study, options->format);
  study->callback([&program, options, study] {
    if (study->get_subcommands().empty()) program.verb = [&program, options] { return begin(program, *options); };
  });

  const auto one = [&](const char* name, const char* meaning, bool needs_id,
                       Exit (*function)(const Program&, const OneStudyOptions&)) {
    auto chosen = std::make_shared<OneStudyOptions>();
    auto* verb = study->add_subcommand(name, meaning);
    if (needs_id) verb->add_option("study", chosen->study, "id of the study")->required();
    on_call(verb, program, chosen, function);
    return std::pair(verb, chosen);
  };
  const auto [get_verb, get_options] = one("get", "what its runs say so far", true, get);
  get_verb->add_flag("--wait", get_options->wait, "until it has ended");
  get_verb->add_option("--plot", get_options->plot, "picture of cost against difference")->type_name("FILE.png");
  get_verb->add_option("--page", get_options->page, "a page with tables and pictures, and the study as JSON, in this folder")
      ->type_name("FOLDER");
  add_format(get_verb, get_options->format);
  const auto [list_verb, list_options] = one("list", "the studies, newest first", false, list);
  add_format(list_verb, list_options->format);
  one("cancel", "cancel the runs that have not ended", true, cancel);
  const auto [delete_verb, delete_options] = one("delete", "forget a study that has ended", true, remove);
  delete_verb->add_flag("--with-jobs", delete_options->with_jobs, "its jobs too, unless other studies use them");
}

}  // namespace bedflow::client
