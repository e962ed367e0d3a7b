// reproduce: a published bed, by several models, beside its experiment.
#include <CLI/CLI.hpp>
#include <memory>

#include "cases/ready_cases.h"
#include "embedded_server.h"
#include "interrupt.h"
#include "job_request.h"
#include "reproduction.h"
#include "study_follow.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct ReproduceOptions {
  std::string bed, data, out = ".";
  std::vector<std::string> presets = {"bedflow", "mfix-exa-2018"};
  std::optional<double> from, bin;
  std::optional<std::uint32_t> bins, ranks;
  bool anew = false;
};

std::optional<Averaging> averaging_of(const ReproduceOptions& options) {
  if (!options.from && !options.bin && !options.bins) return std::nullopt;
  if (!options.from || !options.bin || !options.bins || *options.bins < 2) {
    throw Failure(Exit::usage, "another averaging than the paper's needs --from, --bin and --bins, two bins at least",
                  "bedflow reproduce mueller --from 5 --bin 1 --bins 12");
  }
  return Averaging{*options.from, *options.bin, *options.bins};
}

std::vector<std::string> presets_of(const ReproduceOptions& options) {
  std::vector<std::string> all;
  for (const auto& one : ready_presets()) all.emplace_back(one.name);
  if (options.presets == std::vector<std::string>{"all"}) return all;
  for (const auto& name : options.presets) {
    if (std::ranges::find(all, name) != all.end()) continue;
    std::string known;
    for (const auto& one : all) known += (known.empty() ? "" : ", ") + one;
    throw Failure(Exit::usage, "there is no preset \"" + name + "\"; there are " + known + ", and all");
  }
  return options.presets;
}

// As it can be typed again.
std::string command_of(const ReproduceOptions& options) {
  std::string text = "bedflow reproduce " + options.bed + " --presets ";
  for (std::size_t i = 0; i < options.presets.size(); ++i) text += (i ? "," : "") + options.presets[i];
  if (options.from) text += " --from " + number_text(*options.from);
  if (options.bin) text += " --bin " + number_text(*options.bin);
  if (options.bins) text += " --bins " + std::to_string(*options.bins);
  return text;
}

std::vector<ReproducedRun> results_of(const Connection& connection, const v1::Study& study, const v1::StudySpec& spec) {
  std::vector<ReproducedRun> results;
  for (int i = 0; i < study.runs_size(); ++i) {
    const auto& run = study.runs(i);
    if (run.state() != v1::SUCCEEDED) {
      say(point_name(spec, i) + " is left out: its job " + run.job() + " is " + state_name(run.state()) + ", " + run.message());
      continue;
    }
    v1::QueryStatisticsRequest request;
    request.set_id(run.job());
    request.set_most(1);
    results.push_back({spec.points(i).values(0), spec.points(i).values(1), spec.points(i).case_(),
                       connection.call(&Stub::QueryStatistics, request, 60), run.cost().cpu_seconds()});
  }
  return results;
}

Exit reproduce(const Program& program, const ReproduceOptions& options) {
  Interrupt interrupt;
  v1::CreateStudyRequest request;
  auto& spec = *request.mutable_spec();
  spec = reproduction(conditions_of(options.bed), presets_of(options), averaging_of(options));
  spec.set_name("reproduce " + options.bed);
  spec.mutable_job()->set_ranks(options.ranks.value_or(1));
  spec.set_reuse(!options.anew);
  request.set_request_id(new_request_id());
  std::unique_ptr<EmbeddedServer> own;
  if (!options.data.empty()) own = std::make_unique<EmbeddedServer>(options.data);
  const Connection connection(own ? ServerChoice{own->address(), ""} : program.server);
  const auto id = connection.call(&Stub::CreateStudy, request, 120).id();
  say("study " + id + " of " + std::to_string(spec.points_size()) +
      " runs; Ctrl-C detaches, and the same command comes back to it: what has been run is not run again");
  const auto study = follow_study(connection, id, interrupt, own.get());
  if (!study) {
    if (own) own->leave();
    say("\nthe study goes on");
    return Exit::interrupted;
  }
  const auto results = results_of(connection, *study, spec);
  if (results.empty()) throw Failure(Exit::job_failed, "no run has come to its end", "bedflow study get " + id);
  say("page: " + write_page(options.out, options.bed, command_of(options), results).string());
  return results.size() == static_cast<std::size_t>(spec.points_size()) ? Exit::ok : Exit::job_failed;
}

}  // namespace

void add_reproduce_verb(CLI::App& app, Program& program) {
  const auto options = std::make_shared<ReproduceOptions>();
  auto* verb = app.add_subcommand("reproduce", "a published bed by several models, beside its experiment: a page with pictures");
  verb->add_option("bed", options->bed, "mueller, goldschmidt, link or sscp: all conditions; or one, as goldschmidt-1.5")
      ->required();
  verb->add_option("--presets", options->presets, "models to run; all: every preset")->delimiter(',')->capture_default_str();
  verb->add_option("--from", options->from, "averages begin here, s; as the paper does if absent");
  verb->add_option("--bin", options->bin, "bin of time, s")->check(CLI::PositiveNumber);
  verb->add_option("--bins", options->bins, "how many");
  verb->add_option("--ranks", options->ranks, "MPI ranks of each run")->check(CLI::Range(1, 100000))->default_str("1");
  verb->add_option("--out", options->out, "folder for the page and its pictures")->capture_default_str();
  verb->add_option("--data", options->data, "on a server of its own that keeps its jobs in this folder, as run does");
  verb->add_flag("--anew", options->anew, "run again what an earlier job has run already");
  on_call(verb, program, options, reproduce);
}

}  // namespace bedflow::client
