// How a job comes into being. What was asked is committed to the catalogue, and with that acknowledged: one write to the disk.
// Its folder is laid out from there when it is to start; a job that takes up another one's checkpoint has its folder at once,
// before that checkpoint can be replaced by newer ones.
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <spdlog/spdlog.h>

#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "case_difference.h"
#include "case_file.h"
#include "fidelity.h"
#include "jobs.h"
#include "refusal.h"
#include "security.h"
#include "submission.h"

namespace bedflow::server {

std::string content_of(const google::protobuf::Message& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&coded);
  }
  return bytes;
}

namespace {

namespace fs = std::filesystem;

// The folder as it is before the first attempt, durable.
void write_folder(const JobFolder& folder, const std::string& text, const v1::JobSpec& spec) {
  write_durably(folder.case_file(), text);
  write_durably(folder.spec(), spec);
  std::ofstream(folder.events()).close();  // empty: its growth can be watched from the start
}

// One owner's request ids are nothing to another. Those of "local" stand as they always did.
std::string request_key(const std::string& owner, const std::string& request_id) {
  return owner == local_owner || request_id.empty() ? request_id : owner + "/" + request_id;
}

void move_into_place(const JobFolder& draft, const JobFolder& folder) {
  fs::rename(draft.root(), folder.root());
  sync_folder(folder.root().parent_path());
}

}  // namespace

std::optional<v1::CreateJobResponse> Jobs::earlier_answer(const std::string& owner, const v1::CreateJobRequest& request,
                                                          const std::string& content) const {
  if (request.request_id().empty()) return std::nullopt;
  const auto earlier = catalogue_.find_request(request_key(owner, request.request_id()));
  if (!earlier) return std::nullopt;
  if (earlier->deleted > 0) {
    const auto days = std::chrono::duration_cast<std::chrono::days>(Catalogue::remembered).count();
    throw Refusal(Refused::job_deleted,
                  "request id " + request.request_id() + " made job " + earlier->job +
                      ", which has been deleted; the id is kept for " + std::to_string(days) +
                      " days, so that a late retry does not run the job again",
                  "bedflow submit CASE, with another request id or none");
  }
  if (earlier->content != content) {
    throw Refusal(
        Refused::request_id_reused,
        "request id " + request.request_id() + " has been used for " + earlier->job + " with another case or specification",
        "bedflow get " + earlier->job);
  }
  v1::CreateJobResponse response;
  *response.mutable_job() = view(record_of(earlier->job));
  return response;
}

void Jobs::start_from(v1::CreateJobRequest& request, JobRecord& record) const {
  const auto& source = request.start_from();
  const JobRecord found = record_of(source.job());
  const auto folder = folder_of(source.job());
  const auto step = existing_step(folder, source.job(), source.has_step() ? std::optional(source.step()) : std::nullopt);
  record.job.set_start_from_job(source.job());
  record.job.set_start_from_step(step);
  if (request.packing_only())
    record.job.set_packing_only(true);
  else
    record.from_step = step;
  const v1::Case before = case_of(found);
  if (!request.has_case_()) *request.mutable_case_() = before;
  for (const auto& difference : differences(before, request.case_())) {
    auto& override_made = *record.job.add_overrides();
    override_made.set_path(difference.path);
    override_made.set_from(difference.first);
    override_made.set_to(difference.second);
  }
}

v1::Case Jobs::case_of(const JobRecord& record) const {
  v1::Case value;
  if (read_message(folder_of(record.job.id()).case_file(), value)) return value;
  v1::CreateJobRequest asked;
  if (asked.ParseFromString(catalogue_.content(record)) && asked.has_case_()) return std::move(*asked.mutable_case_());
  throw Refusal(Refused::backend_error, "the case of " + record.job.id() + " cannot be read");
}

v1::Case Jobs::read_case(const std::string& id) {
  const std::lock_guard guard(mutex_);
  return case_of(record_of(id));
}

v1::CreateJobResponse Jobs::create(const Caller& caller, const v1::CreateJobRequest& asked) {
  v1::CreateJobRequest request = asked;
  request.clear_request_id();
  const std::string content = content_of(request);
  request.set_request_id(asked.request_id());
  JobRecord record;
  record.job.set_owner(caller.owner);
  if (asked.has_request_id() && !is_request_id(request.request_id())) {
    throw Refusal(Refused::bad_request,
                  "request_id '" + printable(request.request_id()) + "' is not of the form [A-Za-z0-9-]{8,64}");
  }
  {
    const std::lock_guard guard(mutex_);
    if (auto earlier = earlier_answer(caller.owner, request, content)) return *earlier;
    if (request.has_start_from()) start_from(request, record);
  }
  if (request.packing_only() && !request.has_start_from()) {
    throw Refusal(Refused::bad_request, "packing_only needs start_from: whose particles?",
                  "bedflow submit CASE --packing-of JOB");
  }
  if (!request.has_case_())
    throw Refusal(Refused::bad_request, "the request has neither a case nor start_from", "bedflow init mueller");
  complete(*request.mutable_case_());
  require_sound(request, capacities());
  *record.job.mutable_spec() = request.spec();
  v1::CreateJobResponse response;
  *response.mutable_plan() = planner_.plan(case_text(request.case_()), request.spec().ranks());
  keep_plan(record.job, response.plan());
  if (request.validate_only()) return response;
  auto committed = commit(record, request, content);
  *committed.mutable_plan() = response.plan();
  return committed;
}

// Of the job's specification. What the plan needs must be there when nothing else runs.
void Jobs::keep_plan(v1::Job& job, const v1::PlanReport& plan) const {
  job.set_planned_memory_bytes(static_cast<std::uint64_t>(plan.memory_bytes()));
  job.set_planned_checkpoint_bytes(static_cast<std::uint64_t>(plan.checkpoint_bytes()));
  if (plan.steps() > 0) job.set_planned_step_seconds(plan.seconds() / static_cast<double>(plan.steps()));
  const auto memory = capacities().at(job.spec().executor()).memory_bytes;
  if (memory <= 0 || plan.memory_bytes() <= memory) return;
  v1::Fault fault;
  fault.set_path("memory");
  fault.set_text("needs " + memory_text(plan.memory_bytes()) + " by its plan; all jobs of the executor " + job.spec().executor() +
                 " together may have " + memory_text(memory));
  throw Refusal(Refused::invalid_case, "the case can never run on this server",
                settings_.slurm ? "bedflow submit CASE --executor slurm" : "bedflow explain CASE", {fault});
}

v1::CreateJobResponse Jobs::commit(JobRecord& record, const v1::CreateJobRequest& request, const std::string& content,
                                   const JobFolder* imported) {
  if (!imported) {
    record.job.set_id(new_job_id());
    record.job.set_state(v1::PENDING);
  }
  record.job.set_case_name(request.case_().name());
  *record.job.mutable_spec() = request.spec();
  record.job.set_created_unix_nanos(now_nanos());
  record.job.set_changed_unix_nanos(record.job.created_unix_nanos());
  std::optional<DraftFolder> draft;
  if (imported) write_folder(*imported, case_text(request.case_()), request.spec());
  if (record.job.has_start_from_job()) {
    const JobFolder& folder = draft.emplace(settings_.data / "drafts" / record.job.id()).folder;
    write_folder(folder, case_text(request.case_()), request.spec());
    const auto step = record.job.start_from_step();
    const auto from = folder_of(record.job.start_from_job()).checkpoint(step);
    const auto to = record.from_step ? folder.checkpoint(step) : folder.packing();
    put_beside(from, to);
    sync_folder(to.parent_path());
  }
  const std::lock_guard guard(mutex_);
  if (auto earlier = earlier_answer(record.job.owner(), request, content)) return *earlier;  // a retry has overtaken us
  require_quota(record.job.owner());
  if (const JobFolder* folder = draft ? &draft->folder : imported) move_into_place(*folder, folder_of(record.job.id()));
  catalogue_.insert(record, request_key(record.job.owner(), request.request_id()), content);
  if (is_waiting(record.job.state())) queue_.put(record);
  spdlog::info("{} is {}: case {}, {} ranks, of {}", record.job.id(), state_word(record.job.state()),
               printable(record.job.case_name()), request.spec().ranks(), record.job.owner());
  notifier_.poke();
  v1::CreateJobResponse response;
  *response.mutable_job() = view(record);
  return response;
}

// text: of the case, where there is no folder yet. Needs no lock.
void Jobs::lay_out(const std::string& id, const std::string& text, const v1::JobSpec& spec) const {
  const auto folder = folder_of(id);
  if (!text.empty()) {
    const DraftFolder draft(settings_.data / "drafts" / id);
    write_folder(draft.folder, text, spec);
    move_into_place(draft.folder, folder);
    return;
  }
  v1::JobSpec written;
  const bool is_same = read_message(folder.spec(), written) && written.SerializeAsString() == spec.SerializeAsString();
  if (!is_same) write_durably(folder.spec(), spec);  // resumed on other ranks
}

}  // namespace bedflow::server
