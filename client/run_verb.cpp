// run: a case from nothing to its results, on an embedded server; and on again after whatever happened.
#include "embedded_server.h"
#include "job_request.h"
#include "live_view.h"
#include "statistics_table.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct RunOptions : JobOptions {
  std::string data = "bedflow-data";
  std::string resume;  // FOLDER/ID
  Format format = Format::table;
};

struct ResumeTarget {
  std::filesystem::path data;
  std::string id;
};

// DATA/ID or the job's own folder, DATA/jobs/ID.
ResumeTarget resume_target(const std::string& where) {
  auto path = std::filesystem::absolute(where).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  ResumeTarget target = {path.parent_path(), path.filename().string()};
  if (target.data.filename() == "jobs") target.data = target.data.parent_path();
  if (!std::filesystem::is_directory(target.data / "jobs" / target.id)) {
    std::string there;
    std::error_code error;
    const auto data = std::filesystem::is_directory(path / "jobs") ? path : target.data;
    for (const auto& entry : std::filesystem::directory_iterator(data / "jobs", error))
      there += " " + (data / entry.path().filename()).string();
    throw Failure(Exit::not_found, "--resume " + where + ": there is no such job" + (there.empty() ? "" : "; there are" + there),
                  "bedflow run --resume FOLDER/ID");
  }
  return target;
}

std::string words(const std::filesystem::path& path) {
  const auto relative = std::filesystem::proximate(path);
  return relative.string().size() < path.string().size() ? relative.string() : path.string();
}

// What an earlier run left unfinished here, and how to go on with it.
void tell_unfinished(const Connection& connection, const EmbeddedServer& server, const std::string& case_name) {
  const auto response = connection.call(&Stub::ListJobs, v1::ListJobsRequest());
  for (const auto& job : response.jobs()) {
    if (job.case_name() != case_name || job.state() == v1::SUCCEEDED || job.state() == v1::STATE_CANCELLED) continue;
    const std::string at = job.has_progress() ? " at t = " + number_text(job.progress().time()) + " s" : "";
    say("an earlier job of this case is " + state_name(job.state()) + at + "; go on with it: bedflow run --resume " +
        words(server.data() / job.id()));
  }
}

v1::Job create(const Connection& connection, const EmbeddedServer& server, const v1::CreateJobRequest& request) {
  tell_unfinished(connection, server, request.case_().name());
  return create_job(connection, request).job();
}

// A job that stopped goes on from its checkpoint; one that still runs, or that the new server has taken up, is only watched.
v1::Job resume(const Connection& connection, const std::string& id, const RunOptions& options) {
  auto job = connection.get_job(id);
  if (!is_final(job.state())) return job;
  if (job.state() == v1::SUCCEEDED) {
    say("the job has already succeeded; its results:");
    return job;
  }
  v1::ResumeJobRequest request;
  request.set_id(id);
  if (options.ranks) request.set_ranks(*options.ranks);
  return connection.call(&Stub::ResumeJob, request, 60);
}

void print_results(const Connection& connection, const std::string& id, Format format) {
  v1::QueryStatisticsRequest request;
  request.set_id(id);
  print_statistics(connection.call(&Stub::QueryStatistics, request, 60), format);
}

void tell_where(const v1::Job& job, const EmbeddedServer& server, Exit exit) {
  const auto folder = words(job.folder().empty() ? server.data() / "jobs" / job.id() : std::filesystem::path(job.folder()));
  say("");
  say("job folder: " + folder);
  if (exit == Exit::ok) {
    say("pictures:   bedflow plot " + folder + " -o plot.png");
    say("            bedflow render " + folder + " -o bed.png");
    return;
  }
  say("what it said: bedflow logs " + folder);
  if (job.state() != v1::STATE_CANCELLED) say("go on:        bedflow run --resume " + words(server.data() / job.id()));
}

Exit run(const Program&, const RunOptions& options) {
  Interrupt interrupt;
  if (options.where.empty() == options.resume.empty()) {
    throw Failure(Exit::usage, "run takes a case, or --resume FOLDER/ID", "bedflow run mueller; the ready cases: bedflow init");
  }
  if (!options.resume.empty() && (!options.set.empty() || options.end)) {
    throw Failure(Exit::usage, "--set and --end do not change a job that is resumed", "bedflow submit CASE --start-from JOB");
  }
  const auto target = options.resume.empty() ? ResumeTarget{options.data, ""} : resume_target(options.resume);
  const auto request = options.resume.empty() ? create_request(options) : v1::CreateJobRequest();
  say("bedflow: " + (options.resume.empty() ? "case \"" + request.case_().name() + "\"" : "job " + target.id) +
      " on a server in " + words(std::filesystem::absolute(target.data)));
  EmbeddedServer server(target.data);
  const Connection connection(server.address());
  const auto job = options.resume.empty() ? create(connection, server, request) : resume(connection, target.id, options);

  LiveOptions live;
  live.plan.from_now = !options.resume.empty();
  live.format = options.format == Format::jsonl ? Format::jsonl : Format::table;
  live.lost = [&] { server.revive(); };
  live.detached = {"come back: bedflow run --resume " + words(server.data() / job.id()),
                   "cancel:    bedflow cancel " + job.id() + " --server " + server.address()};
  const auto end = view_job(connection, job.id(), live, interrupt);
  if (end.exit == Exit::interrupted) {
    server.leave();
    return end.exit;
  }
  if (end.exit == Exit::ok && options.format != Format::jsonl) print_results(connection, job.id(), options.format);
  tell_where(end.job, server, end.exit);
  return end.exit;
}

}  // namespace

void add_run_verb(CLI::App& app, Program& program) {
  const auto options = std::make_shared<RunOptions>();
  auto* verb = app.add_subcommand("run", "run a case here and now, without a server of its own; Ctrl-C detaches");
  verb->add_option("case", options->where, "file, - for stdin, or a ready case");
  add_job_options(verb, *options);
  verb->add_option("--data", options->data, "folder that keeps the jobs")->capture_default_str();
  verb->add_option("--resume", options->resume, "go on with an earlier job")->type_name("FOLDER/ID");
  add_format(verb, options->format);
  on_call(verb, program, options, run);
}

}  // namespace bedflow::client
