#include "report/plan_report.h"

#include <google/protobuf/text_format.h>

#include "bedflow/v1/results.pb.h"

namespace bedflow {

std::string plan_report(const Plan& plan) {
  v1::PlanReport report;
  for (const PlanItem& item : plan.items) {
    v1::PlanItem& entry = *report.add_items();
    entry.set_part(item.part);
    entry.set_on(item.on);
    entry.set_why(item.why);
  }
  if (plan.scene.particles) {
    report.set_collision_time(plan.scene.particles->collision_time);
    report.set_substep(plan.substep);
    report.set_substeps(static_cast<std::uint32_t>(plan.substeps));
  }
  report.set_step(plan.step);
  if (plan.cell_ratio > 0) report.set_cell_ratio(plan.cell_ratio);
  report.set_cells(static_cast<std::uint64_t>(plan.cell_count));
  report.set_particles(static_cast<std::uint64_t>(plan.particle_count));
  report.set_memory_bytes(plan.memory_bytes);
  report.set_checkpoint_bytes(plan.checkpoint_bytes);
  report.set_seconds(plan.seconds);
  report.set_steps(static_cast<std::uint64_t>(plan.steps));
  if (!plan.scene.fidelity.empty()) report.set_fidelity(plan.scene.fidelity);
  for (const std::string& warning : plan.warnings) report.add_warnings(warning);
  report.set_text(plan.text());
  std::string text;
  google::protobuf::TextFormat::PrintToString(report, &text);
  return text;
}

}  // namespace bedflow
