// watch, wait, logs: following a job.
#include "live_view.h"
#include "record_log.h"
#include "results.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct WatchOptions {
  std::string job;
  std::uint64_t after = 0;
  bool history = false;
  double away = 120;
  Format format = Format::table;
};

Exit watch(const Program& program, const WatchOptions& options) {
  Interrupt interrupt;
  const Connection connection(program.server);
  LiveOptions live;
  live.plan.after_sequence = options.after;
  live.plan.from_now = !options.history && options.after == 0;
  live.plan.away_seconds = options.away;
  live.format = options.format;
  live.detached = {"come back: bedflow watch " + options.job + program.server.words(),
                   "cancel:    bedflow cancel " + options.job + program.server.words()};
  const auto end = view_job(connection, options.job, live, interrupt);
  if (end.exit == Exit::job_failed) say("what it said: bedflow logs " + options.job + program.server.words());
  return end.exit;
}

struct WaitOptions {
  std::string job, state;
  std::optional<double> timeout;
  Format format = Format::table;
};

Exit wait(const Program& program, const WaitOptions& options) {
  Interrupt interrupt;
  const Connection connection(program.server);
  WatchPlan plan;
  plan.from_now = true;
  plan.timeout_seconds = options.timeout;
  if (!options.state.empty()) {
    v1::JobState state;
    std::string name = options.state;
    for (char& c : name) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    if (!v1::JobState_Parse(name, &state) && !v1::JobState_Parse("STATE_" + name, &state)) {
      throw Failure(
          Exit::usage, "--for " + options.state + " is no state of a job",
          "one of pending, starting, running, succeeded, suspending, suspended, cancelling, cancelled, recovering, failed");
    }
    plan.until_state = state;
  }
  WatchCalls calls;
  calls.note = say;
  const auto result = watch_job(connection, options.job, plan, calls, interrupt);
  if (result.end == WatchEnd::interrupted) return Exit::interrupted;
  if (result.end == WatchEnd::timed_out) {
    throw Failure(Exit::timed_out,
                  "the job " + options.job + " is still " + state_name(result.job.state()) + " after " +
                      number_text(*options.timeout) + " s",
                  "bedflow watch " + options.job);
  }
  Table table({"id", "state"});
  table.add({result.job.id(), state_name(result.job.state())});
  print_message(result.job, table, options.format);
  if (result.end == WatchEnd::state_reached) return Exit::ok;
  if (plan.until_state) {
    throw Failure(
        Exit::wrong_state,
        "the job " + options.job + " is " + state_name(result.job.state()) + " and will not be " + state_name(*plan.until_state),
        "bedflow get " + options.job);
  }
  return exit_of(result.job);
}

struct LogOptions {
  std::string job;
  bool follow = false, all = false;
  Format format = Format::table;
};

void print_log_event(const v1::Event& event, const LogOptions& options) {
  if (!options.all && event.has_progress()) return;
  if (options.format == Format::json || options.format == Format::jsonl) return print_data(json_text(event, false));
  std::string line = event_line(event);
  if (event.has_progress()) line = progress_line(event.progress(), SpeedGauge(), 200, false);
  if (event.has_state()) line = "state " + state_name(event.state().state());
  if (options.format == Format::table) return print_data(time_text(event.unix_nanos()) + "  " + line + "\n");
  Table table({"sequence", "time", "epoch", "text"});
  table.add({event.sequence(), time_text(event.unix_nanos()), std::uint64_t{event.epoch()}, line});
  const auto text = table.text(Format::csv);
  print_data(event.sequence() == 1 ? text : text.substr(text.find('\n') + 1));
}

Exit logs_of_folder(const LogOptions& options) {
  const auto path = std::filesystem::path(options.job) / "events.log";
  LogReader reader(path);
  const bool whole = reader.read([&](const LogRecord& record) {
    v1::Event event;
    if (event.ParseFromString(record.payload)) print_log_event(event, options);
  });
  if (!whole)
    throw Failure(Exit::corrupt, "the event log " + path.string() + " is damaged after byte " + std::to_string(reader.offset()));
  return Exit::ok;
}

Exit logs(const Program& program, const LogOptions& options) {
  if (is_job_folder(options.job)) return logs_of_folder(options);
  Interrupt interrupt;
  const Connection connection(program.server);
  WatchPlan plan;
  plan.until_caught_up = !options.follow;
  WatchCalls calls;
  calls.note = say;
  calls.take = [&](const v1::WatchJobResponse& response) {
    if (response.has_event()) print_log_event(response.event(), options);
  };
  const auto result = watch_job(connection, options.job, plan, calls, interrupt);
  return result.end == WatchEnd::interrupted ? Exit::interrupted : Exit::ok;
}

}  // namespace

void add_watch_verbs(CLI::App& app, Program& program) {
  const auto watch_options = std::make_shared<WatchOptions>();
  auto* verb = app.add_subcommand("watch", "follow a job; Ctrl-C detaches and never cancels");
  verb->add_option("job", watch_options->job, "id of the job")->required();
  verb->add_option("--after", watch_options->after, "events after this sequence number");
  verb->add_flag("--history", watch_options->history, "all events from the first on");
  verb->add_option("--away", watch_options->away, "how long the server may be away, s")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add_format(verb, watch_options->format);
  on_call(verb, program, watch_options, watch);

  const auto wait_options = std::make_shared<WaitOptions>();
  verb = app.add_subcommand("wait", "wait until a job has ended; the exit code tells how");
  verb->add_option("job", wait_options->job, "id of the job")->required();
  verb->add_option("--for", wait_options->state, "wait for this state instead")->type_name("STATE");
  verb->add_option("--timeout", wait_options->timeout, "at most so long, s")->check(CLI::PositiveNumber);
  add_format(verb, wait_options->format);
  on_call(verb, program, wait_options, wait);

  const auto log_options = std::make_shared<LogOptions>();
  verb = app.add_subcommand("logs", "print what a job has told: starts, checkpoints, warnings, its end");
  verb->add_option("job", log_options->job, "id of the job, or its folder")->required();
  verb->add_flag("-f,--follow", log_options->follow, "go on until the job has ended");
  verb->add_flag("--all", log_options->all, "progress too");
  add_format(verb, log_options->format);
  on_call(verb, program, log_options, logs);
}

}  // namespace bedflow::client
