#include "reproduction.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "case_source.h"
#include "cases/ready_cases.h"
#include "failure.h"
#include "terminal.h"

namespace bedflow::client {

std::vector<std::string> published_conditions() {
  std::vector<std::string> names;
  for (const auto& one : ready_cases()) {
    if (one.description.starts_with("short for")) continue;
    for (const char* bed : {"goldschmidt", "mueller", "link", "sscp"})
      if (one.name.starts_with(bed)) names.emplace_back(one.name);
  }
  return names;
}

std::vector<std::string> conditions_of(const std::string& bed) {
  std::vector<std::string> conditions;
  std::string known;
  for (const auto& name : published_conditions()) {
    if (name == bed || name.starts_with(bed + "-")) conditions.push_back(name);
    known += (known.empty() ? "" : ", ") + name;
  }
  if (conditions.empty())
    throw Failure(Exit::usage, "there is no published bed \"" + bed + "\"",
                  "bedflow reproduce BED; the beds and conditions: " + known);
  return conditions;
}

v1::StudySpec reproduction(const std::vector<std::string>& conditions, const std::vector<std::string>& presets,
                           const std::optional<Averaging>& averaging) {
  v1::StudySpec spec;
  spec.add_axes("condition");
  spec.add_axes("preset");
  spec.set_reference(0);
  spec.set_same_packing(false);
  for (const auto& condition : conditions) {
    for (const auto& preset : presets) {
      auto& point = *spec.add_points();
      point.add_values(condition);
      point.add_values(preset);
      v1::Case& value = *point.mutable_case_();
      value = load_case(condition + "@" + preset);
      value.clear_output();
      for (auto& monitor : *value.mutable_monitors()) {
        if (!monitor.has_averaging()) continue;
        if (averaging) {
          monitor.mutable_averaging()->set_start(averaging->start);
          monitor.mutable_averaging()->set_bin(averaging->bin);
          monitor.mutable_averaging()->set_bins(averaging->bins);
          value.mutable_time()->set_end(averaging->start + averaging->bin * averaging->bins);
        }
        if (spec.points_size() == 1) spec.add_quantities()->set_monitor(monitor.name());
      }
    }
  }
  return spec;
}

double disagreement(double a, double half_a, double b, double half_b) {
  return (std::abs(a - b) - half_a - half_b) / (0.5 * std::abs(a + b));
}

std::vector<double> mirrored(const std::vector<double>& values) {
  std::vector<double> result(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) result[i] = 0.5 * (values[i] + values[values.size() - 1 - i]);
  return result;
}

}  // namespace bedflow::client
