// Pins: jobs and checkpoints that neither retention nor removal takes. A pinned checkpoint has a second name, pinned/<its name>,
// so that it stays whatever happens to the first one while it is pinned.
#include <spdlog/spdlog.h>

#include <system_error>

#include "jobs.h"
#include "refusal.h"

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

void pin_checkpoint(const JobFolder& folder, const std::string& id, std::uint64_t step) {
  existing_step(folder, id, step);
  fs::create_directories(folder.pinned());
  try {
    put_beside(folder.checkpoint(step), folder.pin(step));
  } catch (const fs::filesystem_error& gone) {  // removed by the engine in this moment
    existing_step(folder, id, step);
    throw;
  }
  sync_folder(folder.pinned());
  if (!fs::exists(folder.checkpoint(step))) put_beside(folder.pin(step), folder.checkpoint(step));
}

}  // namespace

v1::Job Jobs::set_pin(const Caller& caller, const v1::SetPinRequest& request) {
  const std::lock_guard guard(mutex_);
  const std::string& id = request.name().job();
  JobRecord found = own_record(caller, id);
  const auto live = live_.find(id);
  JobRecord& record = live == live_.end() ? found : live->second.record;
  const JobFolder folder = folder_of(id);
  if (!request.name().has_step()) {
    JobRecord changed = record;
    changed.job.set_pinned(request.pinned());
    catalogue_.update(changed);
    record = changed;
  } else if (request.pinned()) {
    pin_checkpoint(folder, id, request.name().step());
  } else {
    fs::remove(folder.pin(request.name().step()));
  }
  spdlog::info("{}{} is {}pinned", id, request.name().has_step() ? "@" + std::to_string(request.name().step()) : "",
               request.pinned() ? "" : "no longer ");
  return with_pins(record);
}

v1::Job Jobs::with_pins(const JobRecord& record) const {
  v1::Job job = view(record);
  const auto steps = folder_of(job.id()).pinned_steps();
  job.mutable_pinned_steps()->Assign(steps.begin(), steps.end());
  return job;
}

void Jobs::require_no_pin(const JobRecord& record) const {
  const std::string& id = record.job.id();
  if (record.job.pinned()) throw Refusal(Refused::wrong_state, "job " + id + " is pinned", "bedflow unpin " + id);
  const auto steps = folder_of(id).pinned_steps();
  if (!steps.empty()) {
    throw Refusal(Refused::wrong_state, "the checkpoint of step " + std::to_string(steps.front()) + " of " + id + " is pinned",
                  "bedflow unpin " + id + "@" + std::to_string(steps.front()));
  }
}

}  // namespace bedflow::server
