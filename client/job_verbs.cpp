// submit, list, get, cancel, suspend, resume, delete: jobs on a server.
#include <unistd.h>

#include <iostream>

#include "case_source.h"
#include "job_request.h"
#include "job_table.h"
#include "live_view.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct SubmitOptions : JobOptions {
  std::string start_from, request_id;
  bool validate_only = false, watch = false;
  Format format = Format::table;
};

// The case of the job that is started from, with the changes of the command line.
v1::Case changed_case(const Connection& connection, const SubmitOptions& options) {
  auto value = connection.get_job(checkpoint_name(options.start_from).job(), true).case_();
  for (const auto& assignment : options.set) set_value(value, assignment);
  if (options.end) value.mutable_time()->set_end(*options.end);
  auto faults = check_case(value);
  if (!faults.empty()) throw Failure(Exit::usage, "the changed case has faults", "bedflow reference", std::move(faults));
  return value;
}

Exit submit(const Program& program, const SubmitOptions& options) {
  Interrupt interrupt;
  if (options.where.empty() && options.start_from.empty()) {
    throw Failure(Exit::usage, "a case is missing", "bedflow submit CASE, or bedflow submit --start-from JOB");
  }
  auto request = create_request(options);
  if (!options.request_id.empty()) request.set_request_id(options.request_id);
  if (options.validate_only) request.set_validate_only(true);
  if (!options.start_from.empty()) *request.mutable_start_from() = checkpoint_name(options.start_from);
  const Connection connection(program.server);
  if (options.where.empty() && (!options.set.empty() || options.end))
    *request.mutable_case_() = changed_case(connection, options);
  const auto response = create_job(connection, request);
  if (options.validate_only) {
    Table table({"part", "on", "why"});
    for (const auto& item : response.plan().items()) table.add({item.part(), item.on(), item.why()});
    if (options.format == Format::table && response.plan().has_text())
      print_data(response.plan().text() + "\n");
    else
      print_message(response.plan(), table, options.format);
    say("nothing was submitted (--validate-only)");
    return Exit::ok;
  }
  const auto& id = response.job().id();
  if (options.format == Format::table)
    print_data(id + "\n");
  else
    print_message(response.job(), table_of(std::vector{response.job()}), options.format);
  if (!options.watch) {
    say("submitted; next: bedflow watch " + id);
    return Exit::ok;
  }
  LiveOptions live;
  live.detached = {"come back: bedflow watch " + id, "cancel:    bedflow cancel " + id};
  return view_job(connection, id, live, interrupt).exit;
}

struct ListOptions {
  std::vector<std::string> states, labels;
  std::string owner;
  std::uint32_t most = 50;
  Format format = Format::table;
};

Exit list(const Program& program, const ListOptions& options) {
  v1::ListJobsRequest request;
  for (auto name : options.states) {
    for (char& c : name) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    v1::JobState state;
    if (!v1::JobState_Parse(name, &state) && !v1::JobState_Parse("STATE_" + name, &state)) {
      throw Failure(Exit::usage, "--state " + name + " is no state of a job");
    }
    request.add_states(state);
  }
  for (const auto& label : options.labels) {
    const auto equals = label.find('=');
    if (equals == label.npos) throw Failure(Exit::usage, "--label " + label + ": not of the form NAME=VALUE");
    (*request.mutable_labels())[label.substr(0, equals)] = label.substr(equals + 1);
  }
  if (!options.owner.empty()) request.set_owner(options.owner);
  const Connection connection(program.server);
  std::vector<v1::Job> jobs;
  std::string page;
  do {
    request.set_page_size(std::min<std::uint32_t>(1000, options.most - static_cast<std::uint32_t>(jobs.size())));
    request.set_page_token(page);
    const auto response = connection.call(&Stub::ListJobs, request);
    jobs.insert(jobs.end(), response.jobs().begin(), response.jobs().end());
    page = response.next_page_token();
  } while (!page.empty() && jobs.size() < options.most);
  if (jobs.empty()) say("no jobs; submit one with: bedflow submit CASE");
  if (!jobs.empty() || options.format != Format::table) print_messages(pointers(jobs), table_of(jobs), options.format);
  if (!page.empty()) say("there are more; the newest " + std::to_string(jobs.size()) + " are shown, --most shows more");
  return Exit::ok;
}

struct DeleteOptions {
  std::vector<std::string> jobs;
  bool yes = false;
  Format format = Format::table;
};

Exit delete_jobs(const Program& program, const DeleteOptions& options) {
  const Connection connection(program.server);
  if (!options.yes) {
    if (isatty(STDIN_FILENO) != 1)
      throw Failure(Exit::usage, "deleting asks, and there is no terminal to ask on",
                    "bedflow delete --yes " + options.jobs.front());
    for (const auto& id : options.jobs) {
      const auto job = connection.get_job(id);
      say(id + "  " + job.case_name() + "  " + state_name(job.state()));
    }
    std::fputs("delete with all results and checkpoints? [y/N] ", stderr);
    std::string answer;
    std::getline(std::cin, answer);
    if (answer != "y" && answer != "Y" && answer != "yes") {
      say("nothing was deleted");
      return Exit::cancelled;
    }
  }
  Table table({"job", "freed_bytes"});
  for (const auto& id : options.jobs) {
    v1::DeleteJobRequest request;
    request.set_id(id);
    const auto response = connection.call(&Stub::DeleteJob, request, 120);
    table.add({id, response.freed_bytes()});
    say(id + " is deleted; " + bytes_text(response.freed_bytes()) + " are free again");
  }
  if (options.format != Format::table) print_data(table.text(options.format));
  return Exit::ok;
}

struct OneJobOptions {
  std::string job;
  bool with_case = false, skip_checkpoint = false;
  std::optional<std::uint64_t> step;
  std::optional<std::uint32_t> ranks;
  std::optional<double> wall_limit;  // s
  std::optional<int> priority;
  Format format = Format::table;
};

Exit get(const Program& program, const OneJobOptions& options) {
  const auto job = Connection(program.server).get_job(options.job, options.with_case);
  if (options.with_case && options.format == Format::table) {
    print_data(case_text(job.case_()));
  } else {
    print_message(job, table_of(job), options.format);
  }
  return Exit::ok;
}

Exit show_changed(const v1::Job& job, Format format) {
  if (format != Format::table) print_message(job, table_of(std::vector{job}), format);
  say(job.id() + " is " + state_name(job.state()) + (is_final(job.state()) ? "" : "; next: bedflow watch " + job.id()));
  return Exit::ok;
}

Exit cancel(const Program& program, const OneJobOptions& options) {
  v1::CancelJobRequest request;
  request.set_id(options.job);
  if (options.skip_checkpoint) request.set_skip_checkpoint(true);
  return show_changed(Connection(program.server).call(&Stub::CancelJob, request), options.format);
}

Exit suspend(const Program& program, const OneJobOptions& options) {
  v1::SuspendJobRequest request;
  request.set_id(options.job);
  return show_changed(Connection(program.server).call(&Stub::SuspendJob, request), options.format);
}

Exit resume(const Program& program, const OneJobOptions& options) {
  v1::ResumeJobRequest request;
  request.set_id(options.job);
  if (options.step) request.set_step(*options.step);
  if (options.ranks) request.set_ranks(*options.ranks);
  if (options.wall_limit) request.set_wall_limit_seconds(*options.wall_limit);
  if (options.priority) request.set_priority(*options.priority);
  return show_changed(Connection(program.server).call(&Stub::ResumeJob, request, 60), options.format);
}

struct PinOptions {
  std::string job;
  bool pinned = true;
  Format format = Format::table;
};

Exit set_pin(const Program& program, const PinOptions& options) {
  v1::SetPinRequest request;
  *request.mutable_name() = checkpoint_name(options.job);
  request.set_pinned(options.pinned);
  const auto job = Connection(program.server).call(&Stub::SetPin, request);
  if (options.format != Format::table) print_message(job, table_of(std::vector{job}), options.format);
  say(options.job + (options.pinned ? " stays until: bedflow unpin " + options.job : " is no longer pinned"));
  return Exit::ok;
}

}  // namespace

void add_job_verbs(CLI::App& app, Program& program) {
  const auto submit_options = std::make_shared<SubmitOptions>();
  auto* verb = app.add_subcommand("submit", "hand a case to the server; prints the id of the job");
  verb->add_option("case", submit_options->where, "file, - for stdin, or a ready case");
  add_job_options(verb, *submit_options);
  verb->add_option("--executor", submit_options->executor, "where it runs: local, or slurm where the server has it")
      ->type_name("NAME")
      ->default_str("local");
  add_priority(verb, submit_options->priority);
  verb->add_option("--start-from,--from", submit_options->start_from,
                   "start from a checkpoint of a job; without a case its own, which --set changes")
      ->type_name("JOB[@STEP]");
  verb->add_option("--request-id", submit_options->request_id, "8 to 64 letters, digits and -; the same id gives the same job");
  verb->add_flag("--validate-only", submit_options->validate_only, "every check, the plan and the estimate; no job");
  verb->add_flag("--watch", submit_options->watch, "follow the job");
  add_format(verb, submit_options->format);
  on_call(verb, program, submit_options, submit);

  const auto list_options = std::make_shared<ListOptions>();
  verb = app.add_subcommand("list", "list the jobs, newest first");
  verb->add_option("--state", list_options->states, "only in this state")->type_name("STATE");
  verb->add_option("--label", list_options->labels, "only with this label")->type_name("NAME=VALUE");
  verb->add_option("--owner", list_options->owner, "only this owner's; `bedflow server info` tells who you are")
      ->type_name("OWNER");
  verb->add_option("--most", list_options->most, "at most so many")->check(CLI::PositiveNumber)->capture_default_str();
  add_format(verb, list_options->format);
  on_call(verb, program, list_options, list);

  const auto delete_options = std::make_shared<DeleteOptions>();
  verb = app.add_subcommand("delete", "delete jobs that have ended, with all that they left");
  verb->add_option("job", delete_options->jobs, "ids of the jobs")->required();
  verb->add_flag("--yes", delete_options->yes, "do not ask");
  add_format(verb, delete_options->format);
  on_call(verb, program, delete_options, delete_jobs);

  const auto one_job = [&](const char* name, const char* meaning, Exit (*function)(const Program&, const OneJobOptions&)) {
    auto options = std::make_shared<OneJobOptions>();
    verb = app.add_subcommand(name, meaning);
    verb->add_option("job", options->job, "id of the job")->required();
    add_format(verb, options->format);
    on_call(verb, program, options, function);
    return options;
  };
  const auto pin_verb = [&](const char* name, const char* meaning, bool pinned) {
    auto options = std::make_shared<PinOptions>();
    options->pinned = pinned;
    verb = app.add_subcommand(name, meaning);
    verb->add_option("job", options->job, "id of the job; with @STEP that checkpoint alone")->required()->type_name("JOB[@STEP]");
    add_format(verb, options->format);
    on_call(verb, program, options, set_pin);
  };
  const auto get_options = one_job("get", "show a job", get);
  verb->add_flag("--case", get_options->with_case, "its effective case");
  const auto cancel_options = one_job("cancel", "stop a job for good, after a checkpoint", cancel);
  verb->add_flag("--skip-checkpoint", cancel_options->skip_checkpoint, "stop at once, without a checkpoint");
  pin_verb("pin", "keep a job, or one of its checkpoints, whatever retention says", true);
  pin_verb("unpin", "let a pinned job or checkpoint go again", false);
  one_job("suspend", "write a checkpoint and stop until resumed", suspend);
  const auto resume_options = one_job("resume", "go on from a checkpoint", resume);
  verb->add_option("--step", resume_options->step, "checkpoint of this step; the newest good one if absent");
  verb->add_option("--ranks", resume_options->ranks, "on so many ranks; as before if absent")->check(CLI::Range(1, 100000));
  add_wall_limit(verb, resume_options->wall_limit);
  add_priority(verb, resume_options->priority)->default_str("as before");
}

}  // namespace bedflow::client
