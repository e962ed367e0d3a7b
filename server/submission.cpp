#include "submission.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "case_file.h"
#include "refusal.h"
#include "security.h"

namespace bedflow::server {
namespace {

class Faults {
 public:
  void add(const std::string& path, const std::string& text) {
    v1::Fault fault;
    fault.set_path(path);
    fault.set_text(text);
    list_.push_back(std::move(fault));
  }
  void number(const std::string& path, bool present, double value, double low, double high, const char* unit) {
    if (!present || (std::isfinite(value) && value >= low && value <= high)) return;
    std::ostringstream text;
    const std::string of = *unit == 0 ? "" : std::string(" ") + unit;
    text << "is " << value << of << "; allowed are " << low << " to " << high << of;
    add(path, text.str());
  }
  std::vector<v1::Fault> list() && { return std::move(list_); }

 private:
  std::vector<v1::Fault> list_;
};

}  // namespace

std::vector<v1::Fault> check_spec(const v1::JobSpec& spec, const Capacities& executors) {
  Faults faults;
  std::string names;
  std::uint32_t most_ranks = 0;
  for (const auto& [name, capacity] : executors) {
    names += (names.empty() ? "" : ", ") + name;
    if (name == spec.executor() || !executors.contains(spec.executor())) most_ranks = std::max(most_ranks, capacity.most_ranks);
  }
  faults.number("spec.ranks", true, spec.ranks(), 1, most_ranks,
                spec.executor() == "local" ? "ranks (the server's slots)" : "ranks (of one job)");
  if (!executors.contains(spec.executor()))
    faults.add("spec.executor", "is '" + printable(spec.executor()) + "'; this server has: " + names);
  faults.number("spec.priority", spec.has_priority(), spec.priority(), -1000, 1000, "");
  faults.number("spec.wall_limit_seconds", spec.has_wall_limit_seconds(), spec.wall_limit_seconds(), 0, 1e9, "s");
  faults.number("spec.retries.most", true, spec.retries().most(), 0, 100, "retries");
  const auto& policy = spec.checkpoints();
  constexpr double any = 1e18;
  faults.number("spec.checkpoints.every_steps", policy.has_every_steps(), static_cast<double>(policy.every_steps()), 1, any,
                "steps");
  faults.number("spec.checkpoints.every_simulated_seconds", policy.has_every_simulated_seconds(),
                policy.every_simulated_seconds(), 1e-12, 1e9, "s");
  faults.number("spec.checkpoints.every_wall_seconds", policy.has_every_wall_seconds(), policy.every_wall_seconds(), 0.1, 1e9,
                "s");
  faults.number("spec.checkpoints.keep", policy.has_keep(), policy.keep(), 2, 1e6, "files");
  faults.number("spec.checkpoints.keep_every_nth", policy.has_keep_every_nth(), policy.keep_every_nth(), 0, 1e6, "checkpoints");
  faults.number("spec.checkpoints.keep_every_simulated_seconds", policy.has_keep_every_simulated_seconds(),
                policy.keep_every_simulated_seconds(), 1e-12, 1e9, "s");
  if (spec.labels_size() > 64)
    faults.add("spec.labels", "are " + std::to_string(spec.labels_size()) + "; at most 64 are allowed");
  for (const auto& [key, value] : spec.labels()) {
    if (!is_label_key(key))
      faults.add("spec.labels", "key '" + printable(key) + "' is not of the form [a-z0-9][a-z0-9._/-]{0,62}");
    if (value.size() > 255) faults.add("spec.labels", "value of '" + printable(key) + "' is longer than 255 bytes");
  }
  return std::move(faults).list();
}

std::vector<v1::Fault> check_case_fields(const v1::Case& value) {
  Faults faults;
  v1::Case known = value;
  known.DiscardUnknownFields();
  if (known.ByteSizeLong() != value.ByteSizeLong()) {
    faults.add("case",
               "carries fields or values that bedflowd " BEDFLOW_VERSION " does not know; use a client of the same version");
  }
  for (const auto& fault : check_case(value)) faults.add(fault.path, fault.text);
  return std::move(faults).list();
}

void require_sound(const v1::CreateJobRequest& request, const Capacities& executors) {
  auto faults = check_case_fields(request.case_());
  for (auto& fault : check_spec(request.spec(), executors)) faults.push_back(std::move(fault));
  if (faults.empty()) return;
  const std::string count = std::to_string(faults.size()) + (faults.size() == 1 ? " fault" : " faults");
  throw Refusal(Refused::invalid_case, count + " in the case", "bedflow validate CASE", std::move(faults));
}

}  // namespace bedflow::server
