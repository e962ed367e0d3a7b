// What clients ask of studies; what happens by itself is in study_runs.cpp.
#include "studies.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <system_error>

#include "refusal.h"
#include "security.h"

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

constexpr int most_points = 1000;

bool is_study_id(const std::string& id) {
  return id.starts_with("s-") && is_job_id("j-" + id.substr(2));
}

const v1::Monitor* monitor_of(const v1::Case& value, const std::string& name) {
  const auto found = std::ranges::find_if(value.monitors(), [&](const auto& monitor) { return monitor.name() == name; });
  return found == value.monitors().end() ? nullptr : &*found;
}

void check_points(const v1::StudySpec& spec, std::vector<v1::Fault>& faults) {
  const auto fault = [&](const std::string& path, const std::string& text) {
    v1::Fault& added = faults.emplace_back();
    added.set_path("spec." + path);
    added.set_text(text);
  };
  if (spec.points_size() < 2 || spec.points_size() > most_points) {
    fault("points", "are " + std::to_string(spec.points_size()) + "; allowed are 2 to " + std::to_string(most_points));
  }
  if (static_cast<int>(spec.reference()) >= spec.points_size())
    fault("reference", "is " + std::to_string(spec.reference()) + ", but there are " + std::to_string(spec.points_size()) +
                           " points, counted from 0");
  if (spec.quantities().empty()) fault("quantities", "are missing: what is to be compared?");
  for (int i = 0; i < spec.points_size(); ++i) {
    const std::string path = "points[" + std::to_string(i) + "]";
    if (spec.points(i).values_size() != spec.axes_size())
      fault(path + ".values", "are " + std::to_string(spec.points(i).values_size()) + ", but there are " +
                                  std::to_string(spec.axes_size()) + " axes");
    for (const auto& quantity : spec.quantities()) {
      const auto* monitor = monitor_of(spec.points(i).case_(), quantity.monitor());
      if (monitor && monitor->has_averaging()) continue;
      fault(path + ".case.monitors", (monitor ? "has no averaging in '" : "has none called '") + printable(quantity.monitor()) +
                                         "', which the study is to compare");
      if (faults.size() > 20) return;
    }
  }
}

void check_stop(const v1::StudySpec& spec, std::vector<v1::Fault>& faults) {
  if (!spec.has_stop() || (spec.stop().relative() > 0 && spec.stop().relative() <= 1)) return;
  v1::Fault& added = faults.emplace_back();
  added.set_path("spec.stop.relative");
  added.set_text("is " + std::to_string(spec.stop().relative()) + "; allowed are above 0 to 1");
}

v1::StudySpec without_cases(v1::StudySpec spec) {
  for (auto& point : *spec.mutable_points()) point.clear_case_();
  return spec;
}

// The jobs that a study has made, its packing first.
std::vector<std::string> jobs_of(const v1::Study& study) {
  std::vector<std::string> jobs;
  if (study.has_packing_job()) jobs.push_back(study.packing_job());
  for (const auto& run : study.runs())
    if (run.has_job() && !run.reused()) jobs.push_back(run.job());
  return jobs;
}

bool uses(const v1::Study& study, const std::string& job) {
  return study.packing_job() == job || std::ranges::any_of(study.runs(), [&](const auto& run) { return run.job() == job; });
}

std::uint64_t bytes_of(const fs::path& folder) {
  std::uint64_t bytes = 0;
  std::error_code gone;
  for (const auto& entry : fs::directory_iterator(folder, gone)) bytes += entry.file_size(gone);
  return bytes;
}

}  // namespace

Studies::Studies(Jobs& jobs, std::filesystem::path folder) : jobs_(jobs), folder_(std::move(folder)) {
  fs::create_directories(folder_);
  for (const auto& entry : fs::directory_iterator(folder_)) {
    Kept kept;
    if (!is_study_id(entry.path().filename())) continue;
    if (!read_message(entry.path() / "study.txtpb", kept.study) || !read_message(entry.path() / "spec.txtpb", kept.spec)) {
      spdlog::error("the study in {} cannot be read and is left alone", entry.path().string());
      continue;
    }
    *kept.study.mutable_spec() = without_cases(kept.spec);
    if (!kept.study.has_owner()) kept.study.set_owner(local_owner);  // of a time when there were no others
    studies_.emplace(kept.study.id(), std::move(kept));
  }
}

Studies::Kept& Studies::kept(const std::string& id) {
  if (!is_study_id(id))
    throw Refusal(Refused::bad_request, "'" + printable(id) + "' is not a study's id (s- and 12 hex digits)",
                  "bedflow study list");
  const auto found = studies_.find(id);
  if (found == studies_.end()) throw Refusal(Refused::study_not_found, "there is no study " + id, "bedflow study list");
  return found->second;
}

Studies::Kept& Studies::own_kept(const Caller& caller, const std::string& id) {
  Kept& found = kept(id);
  if (caller.may_act_on(found.study.owner())) return found;
  throw Refusal(Refused::not_owner,
                "study " + id + " is " + found.study.owner() + "'s; " + caller.owner + " may look at it, but not act on it",
                "bedflow study list");
}

void Studies::store(const Kept& kept) const {
  write_durably(folder_of(kept.study.id()) / "study.txtpb", kept.study);
}

std::optional<v1::Study> Studies::earlier_answer(const Caller& caller, const v1::CreateStudyRequest& request) const {
  if (request.request_id().empty()) return std::nullopt;
  for (const auto& [id, kept] : studies_) {
    if (kept.study.request_id() != request.request_id() || kept.study.owner() != caller.owner) continue;
    if (content_of(kept.spec) == content_of(request.spec())) return kept.study;
    throw Refusal(Refused::request_id_reused,
                  "request id " + request.request_id() + " has been used for " + id + ", another study",
                  "bedflow study get " + id);
  }
  return std::nullopt;
}

v1::Study Studies::create(const Caller& caller, const v1::CreateStudyRequest& request) {
  if (request.has_request_id() && !is_request_id(request.request_id())) {
    throw Refusal(Refused::bad_request,
                  "request_id '" + printable(request.request_id()) + "' is not of the form [A-Za-z0-9-]{8,64}");
  }
  {
    const std::lock_guard guard(mutex_);
    if (auto earlier = earlier_answer(caller, request)) return *earlier;
  }
  const v1::StudySpec& spec = request.spec();
  std::vector<v1::Fault> faults;
  check_points(spec, faults);
  check_stop(spec, faults);
  if (!faults.empty())
    throw Refusal(Refused::bad_request, "the study has " + std::to_string(faults.size()) + " faults", "bedflow study --help",
                  faults);
  for (int i = 0; i < spec.points_size(); ++i) {  // every check that a job of its own would get
    v1::CreateJobRequest probe;
    *probe.mutable_case_() = spec.points(i).case_();
    *probe.mutable_spec() = spec.job();
    probe.set_validate_only(true);
    try {
      jobs_.create(caller, probe);
    } catch (const Refusal& refusal) {
      std::string values;
      for (const auto& value : spec.points(i).values()) values += (values.empty() ? "" : ", ") + printable(value);
      throw Refusal(refusal.why, "point " + std::to_string(i) + " (" + values + "): " + refusal.what(), refusal.next,
                    refusal.faults);
    }
  }
  Kept kept;
  kept.study.set_id("s-" + new_job_id().substr(2));
  kept.study.set_state(v1::STUDY_RUNNING);
  kept.study.set_created_unix_nanos(now_nanos());
  kept.study.set_request_id(request.request_id());
  kept.study.set_owner(caller.owner);
  kept.spec = spec;
  *kept.study.mutable_spec() = without_cases(spec);
  for (int i = 0; i < spec.points_size(); ++i) kept.study.add_runs();
  const std::lock_guard guard(mutex_);
  if (auto earlier = earlier_answer(caller, request)) return *earlier;
  // Whoever finds the folder finds both files in it.
  const fs::path draft = folder_ / ("draft-" + kept.study.id());
  fs::create_directories(draft);
  write_durably(draft / "spec.txtpb", spec);
  write_durably(draft / "study.txtpb", kept.study);
  fs::rename(draft, folder_of(kept.study.id()));
  sync_folder(folder_);
  spdlog::info("{} is a study of {} runs", kept.study.id(), spec.points_size());
  return studies_.emplace(kept.study.id(), std::move(kept)).first->second.study;
}

v1::Study Studies::get(const std::string& id) {
  const std::lock_guard guard(mutex_);
  Kept& found = kept(id);
  v1::Study study = found.study;
  std::vector<Run> results;
  for (const auto& run : study.runs()) results.push_back(results_of(found, run));
  const Run& reference = results[study.spec().reference()];
  for (int i = 0; i < study.runs_size(); ++i) {
    v1::StudyRun& run = *study.mutable_runs(i);
    if (results[i].cost) *run.mutable_cost() = *results[i].cost;
    for (std::size_t q = 0; q < results[i].quantities.size(); ++q) {
      *run.add_quantities() = overall(results[i].quantities[q]);
      *run.add_errors() =
          q < reference.quantities.size() ? difference(results[i].quantities[q], reference.quantities[q]) : v1::StudyError();
    }
  }
  mark_front(study);
  return study;
}

v1::ListStudiesResponse Studies::list() {
  const std::lock_guard guard(mutex_);
  std::vector<const v1::Study*> newest_first;
  for (const auto& [id, kept] : studies_) newest_first.push_back(&kept.study);
  std::ranges::sort(newest_first, std::greater(), &v1::Study::created_unix_nanos);
  v1::ListStudiesResponse response;
  for (const auto* study : newest_first) *response.add_studies() = *study;
  return response;
}

v1::Study Studies::cancel(const Caller& caller, const std::string& id) {
  const std::lock_guard guard(mutex_);
  Kept& found = own_kept(caller, id);
  if (found.study.state() != v1::STUDY_RUNNING) {
    throw Refusal(Refused::wrong_state, "study " + id + " has ended and cannot be cancelled", "bedflow study get " + id);
  }
  found.study.set_state(v1::STUDY_CANCELLED);
  found.study.set_message("cancelled");
  store(found);
  for (const auto& job : jobs_of(found.study)) {
    try {
      jobs_.cancel(caller, job, false);
    } catch (const Refusal&) {  // it has ended
    }
  }
  return found.study;
}

std::uint64_t Studies::remove(const Caller& caller, const std::string& id, bool with_jobs) {
  const std::lock_guard guard(mutex_);
  Kept& found = own_kept(caller, id);
  if (found.study.state() == v1::STUDY_RUNNING) {
    throw Refusal(Refused::wrong_state, "study " + id + " is running and cannot be deleted", "bedflow study cancel " + id);
  }
  const auto is_of_another = [&](const std::string& job) {
    return std::ranges::any_of(studies_, [&](const auto& other) { return other.first != id && uses(other.second.study, job); });
  };
  std::uint64_t freed = 0;
  for (const auto& job : jobs_of(found.study)) {
    if (!with_jobs || is_of_another(job)) continue;
    try {
      freed += jobs_.remove(caller, job);
    } catch (const Refusal& refusal) {
      if (refusal.why != Refused::job_not_found && refusal.why != Refused::not_owner) throw;  // a packing may be another's
    }
  }
  freed += bytes_of(folder_of(id));
  fs::remove_all(folder_of(id));
  sync_folder(folder_);
  studies_.erase(id);
  return freed;
}

std::set<std::string> Studies::jobs() {
  const std::lock_guard guard(mutex_);
  std::set<std::string> jobs;
  for (const auto& [id, kept] : studies_) {
    if (kept.study.has_packing_job()) jobs.insert(kept.study.packing_job());
    for (const auto& run : kept.study.runs()) jobs.insert(run.job());
  }
  return jobs;
}

bool Studies::is_idle() {
  const std::lock_guard guard(mutex_);
  return std::ranges::none_of(studies_, [](const auto& entry) { return entry.second.study.state() == v1::STUDY_RUNNING; });
}

}  // namespace bedflow::server
