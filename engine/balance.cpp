#include "balance.h"

#include <algorithm>
#include <array>

namespace bedflow {

namespace {

// The move costs about as much as thirty steps (the state goes over, all parts are built anew); plan.balance_steps are a few
// hundred.
constexpr double worth_it = 0.95;

double cell_seconds(const Plan& plan) {
  return plan.cell_count > 0 ? plan.cost.cell : 0;
}

// Of each slab of cells across direction d, all ranks together, direction by direction.
std::array<std::vector<double>, 3> slab_costs(const Decomposition& decomposition, const Plan& plan,
                                              const ParticleStore* particles, const std::vector<double>& costs) {
  const Int3 cells = decomposition.global_cells();
  std::vector<double> all(static_cast<std::size_t>(cells[0] + cells[1] + cells[2]));
  const std::array<int, 3> begin{0, cells[0], cells[0] + cells[1]};
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const Vec3 x = particles->position(i);
    for (int d = 0; d < 3; ++d) all[begin[d] + decomposition.cell_of(d, x[d])] += costs[i];
  }
  decomposition.comm().sum(all);
  std::array<std::vector<double>, 3> slabs;
  for (int d = 0; d < 3; ++d) {
    const double gas = cell_seconds(plan) * cells[(d + 1) % 3] * cells[(d + 2) % 3];
    for (int c = 0; c < cells[d]; ++c) slabs[d].push_back(all[begin[d] + c] + gas);
  }
  return slabs;
}

// Of the dearest block.
double dearest(const Decomposition& decomposition, const Plan& plan, const ParticleStore* particles,
               const std::vector<double>& costs) {
  std::vector<double> blocks(decomposition.comm().size());
  const Int3 cells = decomposition.cells();
  blocks[decomposition.comm().rank()] = cell_seconds(plan) * cells[0] * cells[1] * cells[2];
  for (std::size_t i = 0; i < costs.size(); ++i) blocks[decomposition.owner(particles->position(i))] += costs[i];
  decomposition.comm().sum(blocks);
  return *std::max_element(blocks.begin(), blocks.end());
}

}  // namespace

bool fit(const Cuts& cuts, const Plan& plan) {
  std::size_t blocks = 1;
  for (int d = 0; d < 3; ++d) {
    blocks *= cuts[d].size() - 1;
    if (cuts[d].front() != 0 || cuts[d].back() != plan.cells[d]) return false;
    for (std::size_t place = 1; place < cuts[d].size(); ++place)
      if (cuts[d][place] - cuts[d][place - 1] < plan.narrowest[d]) return false;
  }
  return blocks == static_cast<std::size_t>(plan.ranks);
}

std::optional<Cuts> better_cuts(const Decomposition& decomposition, const Plan& plan, const Dem* dem) {
  if (decomposition.comm().size() == 1) return {};
  std::vector<double> costs;  // of each particle of this rank, a step
  if (dem) {
    for (const int pairs : dem->listed_pairs()) costs.push_back(plan.cost.particle + 0.5 * pairs * plan.cost.pair);
  }
  const ParticleStore* particles = dem ? &dem->particles() : nullptr;
  const auto slabs = slab_costs(decomposition, plan, particles, costs);
  Cuts cuts;
  for (int d = 0; d < 3; ++d) cuts[d] = cheapest_cuts(slabs[d], decomposition.ranks()[d], plan.narrowest[d]);
  if (cuts == decomposition.cuts()) return {};
  const Decomposition moved(decomposition.comm(), decomposition.size(), plan.scene.periodic, cuts);
  const double now = dearest(decomposition, plan, particles, costs), then = dearest(moved, plan, particles, costs);
  if (then > worth_it * now) return {};
  return cuts;
}

}  // namespace bedflow
