// The runs of a study: submitted, stopped when they have said enough, read.
#include <spdlog/spdlog.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "coarse_graining.h"
#include "fidelity.h"
#include "refusal.h"
#include "studies.h"

namespace bedflow::server {
namespace {

constexpr int most_at_once = 20;  // submitted in one round: others want the catalogue too

bool has_ended(const v1::StudyRun& run) {
  return run.has_state() && (is_final(run.state()) || (run.interval_met() && run.state() == v1::STATE_SUSPENDED));
}

// From the summary that the engine leaves when it stops.
std::optional<v1::StudyCost> cost_of(const std::filesystem::path& summary) {
  std::ifstream file(summary);
  if (!file) return std::nullopt;
  const auto json = nlohmann::json::parse(file, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  const double simulated = json.value("simulated_seconds", 0.0);
  if (!(simulated > 0)) return std::nullopt;
  v1::StudyCost cost;
  cost.set_cpu_seconds(json.value("cpu_seconds_per_simulated_second", 0.0));
  const auto phases = json.find("phases");
  if (phases == json.end() || !phases->is_object()) return cost;
  for (const auto& [name, phase] : phases->items()) {
    v1::PhaseCost& added = *cost.add_phases();
    added.set_phase(name);
    added.set_seconds(phase.value("seconds", 0.0) / simulated);
  }
  return cost;
}

// What decides where particles lie at time 0: cases that have it in common can begin with the same ones.
std::string packing_content(const v1::Case& value) {
  const v1::Case computed = parcels_of(value);
  v1::Case kept;
  *kept.mutable_domain()->mutable_size() = computed.domain().size();
  *kept.mutable_walls() = computed.walls();
  auto& particles = *kept.mutable_particles();
  particles = computed.particles();
  particles.clear_density();
  particles.clear_contact();
  particles.clear_tangential();
  particles.clear_rolling();
  particles.clear_cohesion();
  particles.clear_pairs();
  particles.clear_integrator();
  particles.clear_steps_per_collision();
  particles.clear_skin();
  particles.clear_coarse_graining();
  return content_of(kept);
}

// In whose name its runs are made and stopped.
Caller owner_of(const v1::Study& study) {
  return {study.owner(), v1::SUBMIT};
}

}  // namespace

void Studies::advance() {
  std::vector<std::string> running;
  {
    const std::lock_guard guard(mutex_);
    for (const auto& [id, kept] : studies_)
      if (kept.study.state() == v1::STUDY_RUNNING) running.push_back(id);
  }
  for (const auto& id : running) {
    const std::lock_guard guard(mutex_);
    const auto found = studies_.find(id);
    if (found == studies_.end() || found->second.study.state() != v1::STUDY_RUNNING) continue;
    const auto before = found->second.study.SerializeAsString();
    try {
      advance(found->second);
    } catch (const Refusal& refusal) {  // room may come again; a case that this version refuses stays refused
      const bool may_pass =
          refusal.why == Refused::disk_full || refusal.why == Refused::too_much || refusal.why == Refused::quota;
      if (!may_pass) found->second.study.set_state(v1::STUDY_CANCELLED);
      found->second.study.set_message(refusal.what());
    }
    if (found->second.study.SerializeAsString() != before) store(found->second);
  }
}

void Studies::advance(Kept& kept) {
  if (!pack(kept)) return;
  v1::Study& study = kept.study;
  int submitted = 0;
  for (int i = 0; i < study.runs_size(); ++i) {
    if (study.runs(i).has_job()) continue;
    if (++submitted > most_at_once) break;
    submit(kept, i);
  }
  study.clear_message();
  bool all = true;
  for (int i = 0; i < study.runs_size(); ++i) {
    if (study.runs(i).has_job() && !has_ended(study.runs(i))) look_at(kept, i);
    all = all && has_ended(study.runs(i));
  }
  if (!all) return;
  study.set_state(v1::STUDY_DONE);
  spdlog::info("{} is done", study.id());
}

std::string Studies::create_job(const v1::Study& study, const std::string& name, v1::Case value, const std::string& packing_job) {
  v1::CreateJobRequest request;
  *request.mutable_case_() = std::move(value);
  *request.mutable_spec() = study.spec().job();
  auto& labels = *request.mutable_spec()->mutable_labels();
  labels["study"] = study.id();
  labels["study-run"] = name;
  request.set_request_id(study.id() + "-" + name);
  if (!packing_job.empty()) {
    request.mutable_start_from()->set_job(packing_job);
    request.mutable_start_from()->set_step(0);
    request.set_packing_only(true);
  }
  return jobs_.create(owner_of(study), request).job().id();
}

// The reference's particles, seeded and settled: a job of one step, whose checkpoint of step 0 all runs start from.
bool Studies::pack(Kept& kept) {
  v1::Study& study = kept.study;
  const v1::Case& reference = kept.spec.points(static_cast<int>(kept.spec.reference())).case_();
  if (!kept.spec.same_packing() || !reference.has_particles()) return true;
  if (!study.has_packing_job()) {
    v1::Case value = reference;
    v1::CreateJobRequest probe;
    *probe.mutable_case_() = value;
    *probe.mutable_spec() = study.spec().job();
    probe.set_validate_only(true);
    value.mutable_time()->set_end(jobs_.create(owner_of(study), probe).plan().step());
    value.clear_monitors();
    value.clear_references();
    value.clear_output();
    const auto earlier = study.spec().reuse() ? done_before(value, study.spec().job().ranks(), "") : std::nullopt;
    study.set_packing_job(earlier ? *earlier : create_job(study, "packing", std::move(value), ""));
  }
  const v1::Job job = jobs_.get(study.packing_job());
  if (job.state() == v1::SUCCEEDED) return true;
  if (is_final(job.state())) {
    study.set_state(v1::STUDY_CANCELLED);
    study.set_message("the particles could not be packed: job " + job.id() + ": " + job.message());
  }
  return false;
}

void Studies::submit(Kept& kept, int point) {
  const v1::StudySpec& spec = kept.spec;
  v1::StudyRun& run = *kept.study.mutable_runs(point);
  const v1::Case &value = spec.points(point).case_(), &reference = spec.points(static_cast<int>(spec.reference())).case_();
  const bool is_shared = spec.same_packing() && value.has_particles() && packing_content(value) == packing_content(reference);
  const std::string packing = is_shared ? kept.study.packing_job() : "";
  const auto earlier = spec.reuse() ? done_before(value, spec.job().ranks(), packing) : std::nullopt;
  if (earlier) run.set_reused(true);
  run.set_job(earlier ? *earlier : create_job(kept.study, "run-" + std::to_string(point), value, packing));
}

// A job that has run the same case from the same packing to its end.
std::optional<std::string> Studies::done_before(const v1::Case& value, std::uint32_t ranks, const std::string& packing_job) {
  v1::Case whole = value;
  complete(whole);  // as a job keeps it
  const std::string wanted = content_of(whole);
  v1::ListJobsRequest request;
  request.add_states(v1::SUCCEEDED);
  request.set_page_size(1000);
  do {
    const auto page = jobs_.list(request);
    for (const auto& job : page.jobs()) {
      const bool may_be = job.case_name() == value.name() && job.spec().ranks() == ranks && job.start_from_job() == packing_job &&
                          job.packing_only() == !packing_job.empty();
      if (may_be && content_of(jobs_.read_case(job.id())) == wanted) return job.id();
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return std::nullopt;
}

void Studies::look_at(Kept& kept, int point) {
  v1::StudyRun& run = *kept.study.mutable_runs(point);
  v1::Job job;
  try {
    job = jobs_.get(run.job());
  } catch (const Refusal& refusal) {
    if (refusal.why != Refused::job_not_found) throw;
    run.set_state(v1::STATE_CANCELLED);
    run.set_message("its job has been deleted");
    return;
  }
  run.set_state(job.state());
  run.clear_reason();
  run.clear_message();
  if (job.has_reason()) run.set_reason(job.reason());
  if (job.has_message()) run.set_message(job.message());
  const double end = kept.spec.points(point).case_().time().end();
  run.set_done(job.state() == v1::SUCCEEDED ? 1 : job.progress().time() / end);
  if (job.state() != v1::RUNNING || !kept.study.spec().has_stop() || run.interval_met()) return;
  const Run so_far = results_of(kept, run);
  const auto& stop = kept.study.spec().stop();
  for (const auto& quantity : so_far.quantities)
    if (!is_narrow_enough(quantity, stop)) return;
  if (so_far.quantities.empty()) return;
  run.set_interval_met(true);
  try {
    jobs_.suspend(owner_of(kept.study), run.job());
  } catch (const Refusal&) {  // it has ended meanwhile
  }
}

Studies::Run Studies::results_of(Kept& kept, const v1::StudyRun& run) {
  if (!run.has_job()) return {};
  if (const auto known = kept.ended.find(run.job()); known != kept.ended.end()) return known->second;
  Run found;
  try {
    const JobFolder folder = jobs_.folder(run.job());
    v1::QueryStatisticsRequest request;
    request.set_id(run.job());
    request.set_most(1);
    for (const auto& quantity : kept.study.spec().quantities()) request.add_names(quantity.monitor());
    const v1::Statistics statistics = statistics_.query(folder, request);
    for (const auto& quantity : kept.study.spec().quantities()) found.quantities.push_back(measured(statistics, quantity));
    if (has_ended(run)) found.cost = cost_of(folder.summary());
  } catch (const Refusal& refusal) {  // nothing has been measured yet, or the job is gone
    return {};
  }
  if (has_ended(run)) kept.ended.emplace(run.job(), found);
  return found;
}

}  // namespace bedflow::server
