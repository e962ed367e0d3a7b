#include "live_view.h"

namespace bedflow::client {

namespace {

Colour colour_of(v1::JobState state) {
  switch (state) {
    case v1::FAILED:
      return Colour::red;
    case v1::SUCCEEDED:
      return Colour::green;
    case v1::RUNNING:
      return Colour::cyan;
    default:
      return Colour::yellow;
  }
}

std::string state_line(const Terminal& terminal, const v1::Job& job) {
  std::string line = job.id() + " " + terminal.paint(colour_of(job.state()), state_name(job.state()));
  if (job.has_reason() && job.state() == v1::FAILED) line += " " + reason_name(job.reason());
  if (!job.message().empty()) line += ": " + job.message();
  return line;
}

class LiveView {
 public:
  explicit LiveView(Format format) : format_(format) {}

  void take(const v1::WatchJobResponse& response) {
    if (response.has_job() && (!state_ || *state_ != response.job().state())) {
      state_ = response.job().state();
      if (is_final(*state_)) display_.finish();
      display_.message(state_line(display_.terminal(), response.job()));
      if (!response.has_event() && response.job().has_progress() && *state_ == v1::RUNNING)
        display_.update(response.job().progress());
    }
    if (response.has_job() && response.job().waits_for() != waits_for_) {
      waits_for_ = response.job().waits_for();
      if (!waits_for_.empty()) display_.message("waits for " + waits_for_);
    }
    if (!response.has_event()) return;
    const auto& event = response.event();
    if (format_ == Format::json || format_ == Format::jsonl) print_data(json_text(event, false));
    if (event.has_progress()) display_.update(event.progress());
    if (event.has_stopped()) return;  // the state that follows says it
    if (const auto line = event_line(event); !line.empty()) display_.message(line);
  }
  void note(const std::string& line) { display_.message(display_.terminal().paint(Colour::yellow, line)); }
  void finish() { display_.finish(); }

 private:
  ProgressDisplay display_;
  Format format_;
  std::optional<v1::JobState> state_;
  std::string waits_for_;
};

std::string removed_text(const v1::CheckpointWritten& written) {
  std::string steps;
  for (const auto step : written.removed_steps()) steps += (steps.empty() ? "" : ", ") + std::to_string(step);
  return steps.empty() ? "" : "; removed: step " + steps;
}

}  // namespace

std::string event_line(const v1::Event& event) {
  switch (event.what_case()) {
    case v1::Event::kStarted: {
      const auto& started = event.started();
      const std::string ranks = std::to_string(started.ranks()) + (started.ranks() == 1 ? " rank" : " ranks");
      if (started.from_checkpoint().empty()) return "started on " + ranks;
      return "resumed on " + ranks + " from " + started.from_checkpoint() + ", step " + std::to_string(started.step()) +
             ", t = " + number_text(started.time()) + " s";
    }
    case v1::Event::kCheckpoint:
      return "checkpoint of step " + std::to_string(event.checkpoint().step()) +
             ", t = " + number_text(event.checkpoint().time()) + " s, " + bytes_text(event.checkpoint().bytes()) +
             removed_text(event.checkpoint());
    case v1::Event::kLog: {
      const auto severity = event.log().severity();
      return (severity == v1::LogLine::INFO      ? ""
              : severity == v1::LogLine::WARNING ? "warning: "
                                                 : "error: ") +
             event.log().text();
    }
    case v1::Event::kStopped:
      return "stopped at step " + std::to_string(event.stopped().step()) + ", t = " + number_text(event.stopped().time()) +
             " s: " + reason_name(event.stopped().reason()) +
             (event.stopped().message().empty() ? "" : ", " + event.stopped().message());
    default:
      return "";
  }
}

LiveEnd view_job(const Connection& connection, const std::string& id, const LiveOptions& options, Interrupt& interrupt) {
  LiveView view(options.format);
  WatchCalls calls;
  calls.take = [&](const auto& response) { view.take(response); };
  calls.note = [&](const auto& line) { view.note(line); };
  calls.lost = options.lost;
  const auto result = watch_job(connection, id, options.plan, calls, interrupt);
  view.finish();
  if (result.end == WatchEnd::interrupted) {
    say("detached; the job " + id + " is not touched");
    for (const auto& line : options.detached) say("  " + line);
    return {Exit::interrupted, result.job};
  }
  if (result.end == WatchEnd::timed_out) {
    throw Failure(Exit::timed_out,
                  "the job " + id + " is still " + state_name(result.job.state()) + " after " +
                      duration_text(options.plan.timeout_seconds.value_or(0)),
                  "bedflow watch " + id);
  }
  return {is_final(result.job.state()) ? exit_of(result.job) : Exit::ok, result.job};
}

}  // namespace bedflow::client
