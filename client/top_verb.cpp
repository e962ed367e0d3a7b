// top: the jobs as they are now, drawn anew every other second.
#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <map>

#include "connection.h"
#include "interrupt.h"
#include "job_table.h"
#include "progress.h"
#include "screen.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

using Clock = std::chrono::steady_clock;

struct TopOptions {
  bool once = false, all = false;
  double interval = 2;  // s
  std::uint32_t most = 100;
  Format format = Format::table;
};

struct Row {
  v1::Job job;
  std::optional<double> speed;  // simulated s per wall s
};

// What is active, and then what has changed last.
int rank_of(v1::JobState state) {
  switch (state) {
    case v1::RUNNING:
    case v1::STARTING:
    case v1::SUSPENDING:
    case v1::CANCELLING:
      return 0;
    case v1::RECOVERING:
      return 1;
    case v1::PENDING:
      return 2;
    default:
      return 3;
  }
}

class Jobs {
 public:
  Jobs(const Connection& connection, const TopOptions& options) : connection_(connection), options_(options) {}

  // Throws Failure.
  void look() {
    info = connection_.call(&Stub::GetServerInfo, v1::GetServerInfoRequest(), 5);
    v1::ListJobsRequest request;
    request.set_page_size(std::min<std::uint32_t>(options_.most, 1000));
    std::map<std::string, v1::Job> found;
    const auto add = [&] {
      auto response = connection_.call(&Stub::ListJobs, request, 5);
      for (auto& job : *response.mutable_jobs()) found[job.id()] = std::move(job);
    };
    if (options_.all) add();  // the newest, whatever their state
    for (const auto state : {v1::PENDING, v1::RECOVERING, v1::STARTING, v1::RUNNING, v1::SUSPENDING, v1::CANCELLING})
      request.add_states(state);
    add();
    rows.clear();
    for (auto& [id, job] : found) rows.push_back({job, speed_of(job)});
    std::erase_if(gauges_, [&](const auto& entry) { return !found.contains(entry.first); });
    std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
      const int first = rank_of(a.job.state()), second = rank_of(b.job.state());
      if (first != second) return first < second;
      if (first == 2) return a.job.created_unix_nanos() < b.job.created_unix_nanos();
      return a.job.changed_unix_nanos() > b.job.changed_unix_nanos();
    });
  }

  std::vector<Row> rows;
  v1::ServerInfo info;

 private:
  std::optional<double> speed_of(const v1::Job& job) {
    if (job.state() != v1::RUNNING || !job.has_progress()) return std::nullopt;
    SpeedGauge& gauge = gauges_[job.id()];
    gauge.add(job.progress());
    if (const auto speed = gauge.simulated_per_wall()) return speed;
    const auto& progress = job.progress();
    if (progress.eta_seconds() > 0) return (progress.end_time() - progress.time()) / progress.eta_seconds();
    return std::nullopt;
  }

  const Connection& connection_;
  const TopOptions& options_;
  std::map<std::string, SpeedGauge> gauges_;
};

std::string waiting_text(const v1::Job& job) {
  if (!job.waits_for().empty()) return "waits for " + job.waits_for();
  return job.state() == v1::FAILED ? reason_name(job.reason()) : "";
}

// Numbers for programs; for people see below.
Table table_of(const std::vector<Row>& rows) {
  Table table({"job", "owner", "case", "state", "ranks", "progress", "time_s", "end_s", "speed", "eta_s", "memory", "waits_for"});
  for (const auto& [job, speed] : rows) {
    const auto& progress = job.progress();
    const auto if_there = [](bool there, auto value) { return there ? Cell(value) : Cell(); };
    table.add({job.id(), job.owner(), job.case_name(), state_name(job.state()), std::uint64_t{job.spec().ranks()},
               if_there(progress.end_time() > 0, progress.time() / progress.end_time()),
               if_there(job.has_progress(), progress.time()), if_there(job.has_progress(), progress.end_time()),
               if_there(speed.has_value(), speed.value_or(0)),
               if_there(progress.has_eta_seconds() && !is_final(job.state()), progress.eta_seconds()),
               if_there(job.has_memory_bytes(), job.memory_bytes()), if_there(!job.waits_for().empty(), job.waits_for())});
  }
  return table;
}

std::string progress_cell(const v1::Job& job, bool unicode) {
  const auto& progress = job.progress();
  if (progress.end_time() <= 0) return "-";
  std::array<char, 16> percent{};
  const double share = std::clamp(progress.time() / progress.end_time(), 0.0, 1.0);
  std::snprintf(percent.data(), percent.size(), "%5.1f %%", 100 * share);
  return progress_bar(share, 10, unicode) + " " + percent.data();
}

Table for_people(const std::vector<Row>& rows, bool unicode) {
  Table table({"job", "owner", "case", "state", "ranks", "progress", "time / s", "speed", "eta", "memory", ""});
  for (const auto& [job, speed] : rows) {
    const auto& progress = job.progress();
    const bool has_eta = progress.has_eta_seconds() && !is_final(job.state());
    table.add({job.id(), job.owner(), job.case_name(), state_name(job.state()), std::uint64_t{job.spec().ranks()},
               progress_cell(job, unicode),
               job.has_progress() ? number_text(progress.time()) + "/" + number_text(progress.end_time()) : "-",
               speed ? rate_text(*speed) + " s/s" : "-", has_eta ? duration_text(progress.eta_seconds()) : "-",
               job.has_memory_bytes() ? bytes_text(job.memory_bytes()) : "-", waiting_text(job)});
  }
  return table;
}

std::string head_line(const Connection& connection, const v1::ServerInfo& info) {
  return "bedflow top   " + connection.address() + "   " + std::to_string(info.jobs_running()) + " running, " +
         std::to_string(info.jobs_pending()) + " waiting   ranks " + std::to_string(info.ranks_in_use()) + "/" +
         std::to_string(info.slots()) + "   disk " + bytes_text(info.disk_free_bytes()) + " free";
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t start = 0; start < text.size();) {
    const auto end = std::min(text.find('\n', start), text.size());
    lines.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  return lines;
}

// With the last line of the screen for the keys.
std::vector<std::string> picture(const Connection& connection, const Jobs& jobs, const TopOptions& options, const Screen& screen,
                                 const std::string& trouble) {
  const Terminal& terminal = screen.terminal();
  std::vector<std::string> lines = {terminal.paint(Colour::bold, head_line(connection, jobs.info)), ""};
  if (!trouble.empty()) lines[1] = terminal.paint(Colour::red, trouble);
  if (jobs.rows.empty()) {
    lines.push_back(options.all ? "no jobs; submit one with: bedflow submit CASE" : "nothing runs or waits; a: all jobs");
  } else {
    for (auto& line : lines_of(for_people(jobs.rows, terminal.unicode()).text(Format::table))) lines.push_back(std::move(line));
  }
  const auto room = static_cast<std::size_t>(std::max(screen.rows(), 4)) - 1;
  if (lines.size() > room) {
    const auto more = lines.size() - room + 1;
    lines.resize(room - 1);
    lines.push_back("… and " + std::to_string(more) + " more");
  }
  lines.resize(room);
  lines.push_back(terminal.paint(
      Colour::dim, std::string("q: quit   a: ") + (options.all ? "only what is active" : "all jobs") + "   space: look now"));
  return lines;
}

Exit follow(const Connection& connection, TopOptions options) {
  Interrupt interrupt;
  Jobs jobs(connection, options);
  jobs.look();  // a server that is not there is told before the screen changes
  Screen screen;
  std::string trouble;
  auto away_since = Clock::now();
  auto next_look = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.interval));
  while (!interrupt.wait(0) && !screen.has_ended()) {
    screen.draw(picture(connection, jobs, options, screen, trouble));
    const auto key = screen.key(200);
    if (key && std::string_view("q\3").find(*key) != std::string_view::npos) return Exit::ok;  // \3: Ctrl-C
    if (key == 'a') options.all = !options.all;
    if (!key && Clock::now() < next_look) continue;
    next_look = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.interval));
    try {
      jobs.look();
      trouble.clear();
      away_since = Clock::now();
    } catch (const Failure& failure) {
      if (failure.code != Exit::unreachable && failure.code != Exit::timed_out) throw;
      const std::chrono::duration<double> away = Clock::now() - away_since;
      trouble = "the server has been away for " + duration_text(away.count()) + "; its jobs run on, and this table waits for it";
    }
  }
  return Exit::ok;
}

Exit top(const Program& program, const TopOptions& options) {
  Connection connection(program.server);
  const Terminal terminal(stdout);
  if (!options.once && options.format == Format::table && terminal.interactive()) {
    connection.set_quiet();
    return follow(connection, options);
  }
  Jobs jobs(connection, options);
  jobs.look();
  if (options.format != Format::table) {
    print_data(table_of(jobs.rows).text(options.format));
    return Exit::ok;
  }
  print_data(head_line(connection, jobs.info) + "\n");
  if (!jobs.rows.empty()) print_data("\n" + for_people(jobs.rows, terminal.unicode()).text(Format::table));
  if (jobs.rows.empty())
    say(options.all ? "no jobs; submit one with: bedflow submit CASE" : "nothing runs or waits; --all shows what has ended too");
  return Exit::ok;
}

}  // namespace

void add_top_verb(CLI::App& app, Program& program) {
  const auto options = std::make_shared<TopOptions>();
  auto* verb = app.add_subcommand("top", "watch all jobs: state, progress, speed, time left, memory; q quits");
  verb->add_flag("--once", options->once,
                 "print them once; so it is too with -o json, jsonl or csv, and where stdout is no terminal");
  verb->add_flag("--all", options->all, "what has ended too");
  verb->add_option("--most", options->most, "at most so many jobs")->check(CLI::Range(1, 1000))->capture_default_str();
  verb->add_option("--interval", options->interval, "time between two looks, s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  add_format(verb, options->format);
  on_call(verb, program, options, top);
}

}  // namespace bedflow::client
