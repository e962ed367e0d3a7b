// checkpoint list, get, create, verify, download, import.
#include "child.h"
#include "connection.h"
#include "job_request.h"
#include "job_table.h"
#include "terminal.h"
#include "transfer.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct CheckpointOptions {
  std::string job;
  double timeout = 60;
  Format format = Format::table;
};

Exit list_checkpoints(const Program& program, const CheckpointOptions& options) {
  v1::ListCheckpointsRequest request;
  request.set_id(options.job);
  const auto response = Connection(program.server).call(&Stub::ListCheckpoints, request);
  const std::vector<v1::Checkpoint> all(response.checkpoints().begin(), response.checkpoints().end());
  if (all.empty()) say("no checkpoints yet; write one with: bedflow checkpoint create " + options.job);
  if (!all.empty() || options.format != Format::table) print_messages(pointers(all), table_of(all), options.format);
  return Exit::ok;
}

Exit create_checkpoint(const Program& program, const CheckpointOptions& options) {
  v1::CreateCheckpointRequest request;
  request.set_id(options.job);
  request.set_timeout_seconds(options.timeout);
  const auto checkpoint = Connection(program.server).call(&Stub::CreateCheckpoint, request, options.timeout + 10);
  print_message(checkpoint, table_of(std::vector{checkpoint}), options.format);
  return Exit::ok;
}

Exit get_checkpoint(const Program& program, const CheckpointOptions& options) {
  v1::GetCheckpointRequest request;
  *request.mutable_name() = checkpoint_name(options.job);
  const auto checkpoint = Connection(program.server).call(&Stub::GetCheckpoint, request, 120);
  Table table({"what", "name", "unit", "value"});
  table.add({"step", {}, {}, checkpoint.step()});
  table.add({"time", {}, "s", checkpoint.time()});
  table.add({"size", {}, "B", checkpoint.bytes()});
  table.add({"ranks", {}, {}, std::uint64_t{checkpoint.content().ranks()}});
  std::map<std::string, double> numbers(checkpoint.content().numbers().begin(), checkpoint.content().numbers().end());
  for (const auto& [name, value] : numbers) table.add({"number", name, {}, value});
  for (const auto& array : checkpoint.content().arrays()) {
    std::string shape;
    for (const auto extent : array.shape()) shape += (shape.empty() ? "" : " x ") + std::to_string(extent);
    if (!array.name().starts_with("rank_offsets/")) table.add({"array", array.name(), array.unit(), shape});
  }
  for (const auto& one : checkpoint.content().quantities()) table.add({"quantity", one.name(), one.unit(), one.meaning()});
  print_message(checkpoint, table, options.format);
  return Exit::ok;
}

Exit verify_checkpoint(const Program& program, const CheckpointOptions& options) {
  v1::VerifyCheckpointRequest request;
  *request.mutable_name() = checkpoint_name(options.job);
  const auto found = Connection(program.server).call(&Stub::VerifyCheckpoint, request, 3600);
  Table table({"place", "fault"});
  for (const auto& fault : found.faults()) table.add({fault.path(), fault.text()});
  if (options.format != Format::table || !found.good()) print_message(found, table, options.format);
  const std::string which = "the checkpoint of step " + std::to_string(found.step()) + " of " + found.job();
  if (!found.good()) throw Failure(Exit::corrupt, which + " is damaged", "bedflow checkpoint list " + found.job());
  say(which + " is good, " + bytes_text(found.bytes()));
  return Exit::ok;
}

// A line that replaces itself on a terminal, and nothing elsewhere.
class TransferLine {
 public:
  void show(std::uint64_t done, std::uint64_t all) {
    if (!terminal_.interactive()) return;
    std::fprintf(stderr, "\r%s of %s\033[K", bytes_text(done).c_str(), bytes_text(all).c_str());
    shown_ = true;
  }
  ~TransferLine() {
    if (shown_) std::fputs("\r\033[K", stderr);
  }

 private:
  Terminal terminal_{stderr};
  bool shown_ = false;
};

struct DownloadOptions {
  std::string job, out;
  double away = 120;
};

// With the reader that came with this client, where there is one.
void verify_file(const std::filesystem::path& file) {
  std::filesystem::path reader;
  try {
    reader = beside_own_executable("bedflow-reader");
  } catch (const Failure&) {
    return say("not verified: bedflow-reader is not beside bedflow");
  }
  const auto result = run_child({reader.string(), "--seconds", "3600", "verify", file.string()});
  const std::string faults = result.out + result.error;
  if (result.exit_code == v1::CHECKPOINT_CORRUPT || !result.out.empty())
    throw Failure(Exit::corrupt, "the file " + file.string() + " is damaged: " + faults, "bedflow checkpoint verify");
  if (result.exit_code != 0) {
    throw Failure(Exit::other,
                  "the file " + file.string() + " came over whole but is not verified: bedflow-reader " +
                      (faults.empty() ? "ended by exit code " + std::to_string(result.exit_code) : "said " + faults),
                  reader.string() + " verify " + file.string());
  }
}

Exit download(const Program& program, const DownloadOptions& options) {
  std::filesystem::path file;
  {
    TransferLine line;
    TransferCalls calls;
    calls.note = say;
    calls.progress = [&](std::uint64_t done, std::uint64_t all) { line.show(done, all); };
    file = download_checkpoint(Connection(program.server), checkpoint_name(options.job), options.out, options.away, calls);
  }
  verify_file(file);
  print_data(file.string() + "\n");
  return Exit::ok;
}

struct ImportOptions {
  std::string file;
  std::optional<std::uint32_t> ranks;
  std::vector<std::string> labels;
  Format format = Format::table;
};

Exit import(const Program& program, const ImportOptions& options) {
  v1::ImportCheckpointRequest::Head head;
  head.set_request_id(new_request_id());
  if (options.ranks) head.mutable_spec()->set_ranks(*options.ranks);
  set_labels(*head.mutable_spec(), options.labels);
  v1::Job job;
  {
    TransferLine line;
    TransferCalls calls;
    calls.progress = [&](std::uint64_t done, std::uint64_t all) { line.show(done, all); };
    job = import_checkpoint(Connection(program.server), options.file, head, calls);
  }
  if (options.format == Format::table)
    print_data(job.id() + "\n");
  else
    print_message(job, table_of(std::vector{job}), options.format);
  say(job.message() + ": bedflow resume " + job.id() + ", or bedflow submit --start-from " + job.id());
  return Exit::ok;
}

}  // namespace

void add_checkpoint_verbs(CLI::App& app, Program& program) {
  auto* checkpoint = app.add_subcommand("checkpoint", "checkpoints of a job");
  checkpoint->require_subcommand(1);
  const auto one = [&](const char* name, const char* meaning, const char* which,
                       Exit (*function)(const Program&, const CheckpointOptions&)) {
    auto options = std::make_shared<CheckpointOptions>();
    auto* verb = checkpoint->add_subcommand(name, meaning);
    auto* job = verb->add_option("job", options->job, "id of the job")->required();
    if (*which) job->type_name(which);
    add_format(verb, options->format);
    on_call(verb, program, options, function);
    return std::pair(verb, options);
  };
  one("list", "list them, newest first", "", list_checkpoints);
  one("get", "what one holds: totals, arrays, quantities that may be asked for", "JOB[@STEP]", get_checkpoint);
  const auto [create, create_options] = one("create", "write one now; the job goes on", "", create_checkpoint);
  create->add_option("--timeout", create_options->timeout, "wait for it at most so long, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  one("verify", "check every block of one: names what is damaged", "JOB[@STEP]", verify_checkpoint);

  const auto download_options = std::make_shared<DownloadOptions>();
  auto* verb = checkpoint->add_subcommand("download", "get the file of one; goes on where an earlier try stopped");
  verb->add_option("job", download_options->job, "id of the job")->required()->type_name("JOB[@STEP]");
  verb->add_option("-o,--out", download_options->out, "the file; the checkpoint's name if absent")->type_name("FILE.h5");
  verb->add_option("--away", download_options->away, "how long the server may be away, s")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  on_call(verb, program, download_options, download);

  const auto import_options = std::make_shared<ImportOptions>();
  verb = checkpoint->add_subcommand("import", "make a suspended job of a checkpoint file; prints its id");
  verb->add_option("file", import_options->file, "the checkpoint")->required()->check(CLI::ExistingFile);
  verb->add_option("--ranks", import_options->ranks, "ranks of the job; as many as wrote the file if absent")
      ->check(CLI::Range(1, 100000));
  verb->add_option("--label", import_options->labels, "label to find the job by")->type_name("NAME=VALUE");
  add_format(verb, import_options->format);
  on_call(verb, program, import_options, import);
}

}  // namespace bedflow::client
