#include "summary.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

namespace bedflow {

namespace {

using nlohmann::json;

// What this rank tells: the seconds of each phase, then the rest by name.
enum Told { wall = phase_count, cpu, in_steps, communication, messages, bytes, told };
std::array<double, told> costs_of(const PhaseTimer& timer, const RunTotals& totals) {
  std::array<double, told> costs{};
  for (int phase = 0; phase < phase_count; ++phase) costs[phase] = timer[static_cast<Phase>(phase)].seconds;
  costs[wall] = timer.seconds();
  costs[cpu] = totals.cpu_seconds;
  costs[in_steps] = totals.step_seconds;
  costs[communication] = totals.traffic.seconds;
  costs[messages] = static_cast<double>(totals.traffic.messages);
  costs[bytes] = static_cast<double>(totals.traffic.bytes);
  return costs;
}

bool is_gas(Phase phase) {
  return phase == Phase::momentum || phase == Phase::pressure;
}
bool is_transfer(Phase phase) {
  return phase == Phase::deposit || phase == Phase::sample || phase == Phase::halo;
}
bool is_dem(Phase phase) {
  return phase == Phase::pairs || phase == Phase::contacts || phase == Phase::walls || phase == Phase::integration ||
         phase == Phase::migration;
}

// What a phase's work is counted in: the particles' phases per particle and sub-step, the others per cell and step.
const char* unit_of(Phase phase) {
  if (is_dem(phase)) return "particle and sub-step";
  if (phase == Phase::deposit || phase == Phase::sample) return "particle and step";
  return "cell and step";
}

json phase_entry(const char* unit, double seconds, double units) {
  json entry = {{"seconds", seconds}, {"per", unit}};
  if (units > 0) entry["nanoseconds_per_unit"] = seconds * 1e9 / units;
  return entry;
}

// Moments of the diameters of each type, m and kg.
json sizes_entry(const ParticleScene& particles, const std::vector<SizeMoments>& sizes) {
  json entries = json::array();
  for (std::size_t k = 0; k < sizes.size(); ++k)
    entries.push_back({{"type", particles.kinds[k].name},
                       {"count", sizes[k].count},
                       {"mean", sizes[k].mean},
                       {"deviation", sizes[k].deviation},
                       {"sauter", sizes[k].sauter},
                       {"smallest", sizes[k].smallest},
                       {"largest", sizes[k].largest},
                       {"mass", sizes[k].mass}});
  return entries;
}

// Particles since time 0, kg.
json turnover_entry(const RunTotals& totals) {
  const auto entry = [](const Amount& amount) { return json{{"count", amount.count}, {"mass", amount.mass}}; };
  const auto vector = [](Vec3 v) { return json{v.x, v.y, v.z}; };
  return {{"initial", entry(totals.turnover.initial)},
          {"entered", entry(totals.turnover.entered)},
          {"left", entry(totals.turnover.left)},
          {"momentum_left", vector(totals.turnover.momentum_left)},
          {"impulse_owed_to_left", vector(totals.turnover.debt_left)},
          {"mass_due", totals.mass_due},
          {"blocked_steps", totals.blocked_steps}};
}

}  // namespace

void write_summary(const Comm& comm, const std::filesystem::path& path, const Plan& plan, const PhaseTimer& timer,
                   const RunTotals& totals) {
  const auto mine = costs_of(timer, totals);
  const std::vector<double> all = comm.gather_all(mine);
  if (!comm.root()) return;

  const auto particle_substeps = static_cast<double>(totals.particle_substeps),
             cell_steps = static_cast<double>(totals.cell_steps);
  const double particle_steps = static_cast<double>(totals.particle_steps);
  double gas = 0, transfer = 0, dem = 0, busy = 0, cpu_seconds = 0, steps = 0, talk = 0, most_work = 0;
  json phases, ranks = json::array();
  for (int rank = 0; rank < comm.size(); ++rank) {
    const double* costs = all.data() + rank * mine.size();
    ranks.push_back({{"wall_seconds", costs[wall]},
                     {"communication_seconds", costs[communication]},
                     {"messages", costs[messages]},
                     {"message_bytes", costs[bytes]}});
    cpu_seconds += costs[cpu];
    steps += costs[in_steps];
    talk += costs[communication];
    most_work = std::max(most_work, costs[in_steps] - costs[communication]);
  }
  for (int p = 0; p < phase_count; ++p) {
    const Phase phase = static_cast<Phase>(p);
    double seconds = 0;  // all ranks
    for (int rank = 0; rank < comm.size(); ++rank) {
      const double share = all[rank * mine.size() + p];
      seconds += share;
      ranks[rank]["seconds"][std::string(phase_names[p])] = share;
    }
    const double units = is_dem(phase) ? particle_substeps : unit_of(phase)[0] == 'p' ? particle_steps : cell_steps;
    phases[std::string(phase_names[p])] = phase_entry(unit_of(phase), seconds, units);
    gas += is_gas(phase) ? seconds : 0;
    transfer += is_transfer(phase) ? seconds : 0;
    dem += is_dem(phase) ? seconds : 0;
    busy += phase == Phase::other || phase == Phase::checkpoint || phase == Phase::output ? 0 : seconds;
  }
  json summary = {{"case", plan.scene.name},
                  {"exit_code", static_cast<int>(totals.reason)},
                  {"ranks", comm.size()},
                  {"wall_seconds", timer.seconds()},
                  {"cpu_seconds", cpu_seconds},
                  {"settling_seconds", totals.settling_seconds},
                  {"simulated_seconds", totals.simulated_seconds},
                  {"steps", totals.steps},
                  {"substeps", totals.substeps},
                  {"particles", totals.particles},
                  {"cells", plan.cell_count},
                  {"list_rebuilds", totals.list_rebuilds},
                  {"block_moves", totals.block_moves},
                  {"gas_iterations", totals.gas_iterations},
                  {"pressure_iterations", totals.pressure_iterations},
                  {"phases", phases},
                  {"per_rank", ranks}};
  if (plan.scene.particles) {
    summary["particle_sizes"] = sizes_entry(*plan.scene.particles, totals.sizes);
    summary["turnover"] = turnover_entry(totals);
  }
  if (particle_substeps > 0) summary["particle_substep_microseconds"] = dem * 1e6 / particle_substeps;
  if (cell_steps > 0) summary["gas_cell_step_microseconds"] = gas * 1e6 / cell_steps;
  if (steps > 0) summary["communication_share"] = talk / steps;
  if (steps > talk) summary["balance"] = most_work * comm.size() / (steps - talk);
  if (busy > 0) summary["gas_share"] = gas / busy;
  if (busy > 0) summary["transfer_share"] = transfer / busy;
  if (totals.simulated_seconds > 0) summary["cpu_seconds_per_simulated_second"] = cpu_seconds / totals.simulated_seconds;

  const std::filesystem::path partial = path.string() + ".partial";
  std::ofstream file(partial);
  file << summary.dump(2) << "\n";
  file.close();
  if (!file) throw std::system_error(errno, std::generic_category(), partial.string());
  std::filesystem::rename(partial, path);
}

}  // namespace bedflow
