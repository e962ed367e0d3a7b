// stats, plot, render: what a job has yielded, through the server or from its folder.
#include "gnuplot.h"
#include "job_table.h"
#include "plot.h"
#include "render.h"
#include "results.h"
#include "statistics_follow.h"
#include "statistics_table.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct StatsOptions {
  std::string job;
  StatisticsQuery query;
  bool samples = false, list = false, follow = false;
  Format format = Format::table;
};

Exit list_series(const Program& program, const StatsOptions& options) {
  const auto series = Results(options.job, program.server).series();
  Table table({"name", "kind", "unit", "samples", "last_step", "last_time_s", "bins", "meaning"});
  for (const auto& one : series) {
    const bool profile = one.monitor().is_profile();
    table.add({one.monitor().name(), std::string(profile ? "profile" : "series"), one.monitor().unit(),
               profile ? Cell() : Cell(one.samples()), profile ? Cell() : Cell(one.last_step()),
               profile ? Cell() : Cell(one.last_time()), std::uint64_t{one.bins()}, one.monitor().meaning()});
  }
  if (series.empty()) say("no series yet: the case has no monitors, or the job has not begun");
  if (!series.empty() || options.format != Format::table) print_messages(pointers(series), table, options.format);
  return Exit::ok;
}

Exit follow(const Program& program, const StatsOptions& options) {
  if (is_job_folder(options.job)) {
    throw Failure(Exit::usage, "--follow follows a job of a server; " + options.job + " is a folder",
                  "name the job and its server: bedflow stats ID --follow --server unix:DATA/bedflowd.sock");
  }
  const auto& query = options.query;
  follow_statistics(Connection(program.server), options.job,
                    {query.names, query.from_time, query.to_time, query.from_step, query.to_step}, options.format);
  return Exit::ok;
}

Exit stats(const Program& program, const StatsOptions& options) {
  if (options.list) return list_series(program, options);
  if (options.follow) return follow(program, options);
  const auto statistics = Results(options.job, program.server).statistics(options.query);
  if (statistics.series_size() + statistics.profiles_size() == 0)
    say("no statistics yet: the case has no monitors, or the job has not begun");
  if (options.samples)
    print_samples(statistics, options.format);
  else
    print_statistics(statistics, options.format);
  return Exit::ok;
}

struct PlotOptions {
  std::string job;
  StatisticsQuery query;
  std::string out;
};

Exit plot(const Program& program, const PlotOptions& options) {
  const Results results(options.job, program.server);
  auto query = options.query;
  query.most = 4000;  // more than the picture has pixels
  const auto statistics = results.statistics(query);
  if (statistics.series_size() + statistics.profiles_size() == 0) {
    throw Failure(Exit::not_found, "the job " + options.job + " has no statistics to plot",
                  "add monitors to the case (bedflow reference), or wait for the first values");
  }
  draw_picture(plot_script(statistics, results.effective_case(), results.name(), options.out), options.out);
  say("drawn: " + options.out);
  return Exit::ok;
}

struct RenderOptions {
  std::string job;
  std::string out;
  std::optional<std::uint64_t> step;
  std::uint32_t most = 200'000;
};

Exit render(const Program& program, const RenderOptions& options) {
  const Results results(options.job, program.server);
  const auto snapshot = results.snapshot(options.step, options.most);
  draw_picture(render_script(snapshot, results.name(), options.out), options.out);
  say("drawn: " + options.out + ", step " + std::to_string(snapshot.step()) + ", t = " + number_text(snapshot.time()) + " s");
  return Exit::ok;
}

void add_query(CLI::App* verb, std::string& job, StatisticsQuery& query) {
  verb->add_option("job", job, "id of the job, or its folder")->required();
  verb->add_option("name", query.names, "only these monitors");
  verb->add_option("--from", query.from_time, "samples from this time on, s");
  verb->add_option("--to", query.to_time, "samples up to this time, s");
  verb->add_option("--from-step", query.from_step, "samples from this step on");
  verb->add_option("--to-step", query.to_step, "samples up to this step");
}

}  // namespace

void add_result_verbs(CLI::App& app, Program& program) {
  const auto stats_options = std::make_shared<StatsOptions>();
  auto* verb = app.add_subcommand("stats", "series and profiles so far, with 95 % intervals");
  add_query(verb, stats_options->job, stats_options->query);
  verb->add_flag("--samples", stats_options->samples, "the samples of the series instead of their means");
  verb->add_option("--most", stats_options->query.most,
                   "thin each series to so many groups of samples: mean, minimum and maximum of each");
  verb->add_flag("--list", stats_options->list, "the names of series and profiles instead, with unit and meaning");
  verb->add_flag("-f,--follow", stats_options->follow, "samples as they come, until the job has ended");
  add_format(verb, stats_options->format);
  on_call(verb, program, stats_options, stats);

  const auto plot_options = std::make_shared<PlotOptions>();
  verb = app.add_subcommand("plot", "draw series and profiles with their intervals and the case's reference data");
  add_query(verb, plot_options->job, plot_options->query);
  verb->add_option("-o,--out", plot_options->out, "the picture")->required()->type_name("FILE.png");
  on_call(verb, program, plot_options, plot);

  const auto render_options = std::make_shared<RenderOptions>();
  verb = app.add_subcommand("render", "draw the bed: particles coloured by speed, and the gas fraction");
  verb->add_option("job", render_options->job, "id of the job, or its folder")->required();
  verb->add_option("-o,--out", render_options->out, "the picture")->required()->type_name("FILE.png");
  verb->add_option("--step", render_options->step, "checkpoint of this step; the newest good one if absent");
  verb->add_option("--most", render_options->most, "at most so many particles")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  on_call(verb, program, render_options, render);
}

}  // namespace bedflow::client
