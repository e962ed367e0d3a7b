// The simulation's state to and from a checkpoint.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "base/short_number.h"
#include "particles/migration.h"
#include "simulation.h"

namespace bedflow {

namespace {

constexpr std::array<const char*, 3> velocity_names = {"gas/velocity_x", "gas/velocity_y", "gas/velocity_z"};
constexpr std::array<const char*, 3> fall_names = {"gas/fall_x", "gas/fall_y", "gas/fall_z"};  // GasState::fall

// This rank's cells; for a face field of direction d the box's last face goes with the last block.
GridPart part_of(const Grid& grid, int d = -1) {
  GridPart part{grid.global, grid.first, grid.cells};
  if (d >= 0) {
    part.global[d] += 1;
    if (grid.first[d] + grid.cells[d] == grid.global[d]) part.count[d] += 1;
  }
  return part;
}

template <class FieldType, class Take>
void each(FieldType& field, const GridPart& part, Take take) {
  for (int k = 0; k < part.count[2]; ++k)
    for (int j = 0; j < part.count[1]; ++j)
      for (int i = 0; i < part.count[0]; ++i) take(field(i, j, k));
}

CheckpointArray grid_array(const char* name, const char* unit, const char* meaning, const Field& field, const GridPart& part) {
  std::vector<double> values;
  each(field, part, [&](double value) { values.push_back(value); });
  return {name, unit, meaning, std::move(values), part, 1};
}

void read_grid(const CheckpointSource& from, const char* name, Field& field, const GridPart& part) {
  const std::vector<double> values = from.grid(name, part);
  const double* next = values.data();
  each(field, part, [&](double& value) { value = *next++; });
}

std::vector<double> flat(std::span<const Vec3> vectors) {
  std::vector<double> values;
  values.reserve(3 * vectors.size());
  for (const Vec3& v : vectors) values.insert(values.end(), {v.x, v.y, v.z});
  return values;
}
std::vector<Vec3> vectors(const std::vector<double>& values) {
  std::vector<Vec3> result(values.size() / 3);
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
  return result;
}

CheckpointArray rows(const char* name, const char* unit, const char* meaning, std::span<const Vec3> values) {
  return {name, unit, meaning, flat(values), std::nullopt, 3};
}

std::vector<std::int64_t> block_row(const Decomposition& decomposition) {
  const Int3 first = decomposition.first(), cells = decomposition.cells();
  return {first[0], first[1], first[2], cells[0], cells[1], cells[2]};
}

}  // namespace

std::optional<Cuts> Simulation::blocks_of(const CheckpointSource& from, const Comm& comm) {
  if (from.ranks() != comm.size() || !from.has("blocks")) return {};
  const std::vector<std::int64_t> mine = from.integer_rows("blocks");
  const std::vector<double> all = comm.gather_all(std::vector<double>(mine.begin(), mine.end()));
  constexpr double most_cells = 1e9;  // the file may come from anywhere
  const auto plausible = [](double cell) { return cell >= 0 && cell <= most_cells; };
  if (all.size() != 6 * static_cast<std::size_t>(comm.size()) || !std::ranges::all_of(all, plausible)) return {};
  std::array<std::set<int>, 3> cuts;
  for (std::size_t r = 0; r < all.size(); r += 6)
    for (std::size_t d = 0; d < 3; ++d) {
      cuts[d].insert(static_cast<int>(all[r + d]));
      cuts[d].insert(static_cast<int>(all[r + d] + all[r + 3 + d]));
    }
  Cuts result;
  for (int d = 0; d < 3; ++d) result[d].assign(cuts[d].begin(), cuts[d].end());
  return result;
}

CheckpointContent Simulation::checkpoint() const {
  CheckpointContent content;
  content.step = steps_;
  content.time = time_;
  const Vec3 size = plan_.scene.size;
  content.numbers = {{"domain/size_x", size.x},
                     {"domain/size_y", size.y},
                     {"domain/size_z", size.z},
                     {"cells/x", plan_.scene.cells[0]},
                     {"cells/y", plan_.scene.cells[1]},
                     {"cells/z", plan_.scene.cells[2]},
                     {"controller/step_size", controller_.size()},
                     {"controller/last_step", last_step_},
                     {"controller/good_steps", controller_.good_steps()}};
  content.arrays.push_back(
      {"blocks", "", "each rank's first cells in x, y, z and numbers of cells", block_row(decomposition_), std::nullopt, 6});
  if (gas_) {
    const GasState& gas = gas_->state;
    content.arrays.push_back(
        grid_array("gas/pressure", "Pa", "gas pressure p at cell centres", gas.pressure, part_of(gas_->grid)));
    content.arrays.push_back(grid_array("gas/fraction", "1", "gas fraction ε of the last deposit, at cell centres", gas.fraction,
                                        part_of(gas_->grid)));
    for (int d = 0; d < 3; ++d) {
      content.arrays.push_back(grid_array(velocity_names[d], "m/s", "gas velocity at the faces of its direction", gas.velocity[d],
                                          part_of(gas_->grid, d)));
      content.numbers[fall_names[d]] = gas.fall[d];
    }
  }
  if (dem_) {
    put_particles(content);
    if (dem_->setup().history || dem_->setup().rolling_history) put_contacts(content);
    put_turnover(content);
  }
  return content;
}

void Simulation::put_particles(CheckpointContent& content) const {
  const ParticleStore& store = dem_->particles();
  const DemSetup& setup = dem_->setup();
  const std::size_t n = store.owned;
  const Amount there = present();
  content.numbers["particles/diameter"] = plan_.scene.particles->largest();
  content.numbers["particles/types"] = static_cast<double>(setup.types.size());
  for (std::size_t t = 0; t < setup.types.size(); ++t) {
    content.numbers["particles/type_" + std::to_string(t) + "_density"] = setup.types[t].density;
    content.numbers["particles/type_" + std::to_string(t) + "_diameter"] = 2 * setup.types[t].radius;
  }
  content.numbers["particles/count"] = static_cast<double>(there.count);
  content.numbers["particles/total_mass"] = there.mass;
  if (plan_.tuned_skin) {
    const Dem::Tuning tuning = dem_->tuning();
    content.numbers["particles/skin"] = tuning.skin;
    content.numbers["particles/skin_substeps"] = static_cast<double>(tuning.counts.substeps);
    content.numbers["particles/skin_rebuilds"] = static_cast<double>(tuning.counts.rebuilds);
  }
  Vec3 momentum;
  for (std::size_t p = 0; p < n; ++p) momentum += mass_of(setup.types, store, p) * store.velocity(p);
  for (int d = 0; d < 3; ++d) {
    content.numbers[std::string("particles/total_momentum_") + "xyz"[d]] = decomposition_.comm().sum(momentum[d]);
  }
  content.arrays.push_back(rows("particles/position", "m", "centres", store.positions()));
  content.arrays.push_back(rows("particles/velocity", "m/s", "velocities V", store.velocities()));
  if (setup.rotation) content.arrays.push_back(rows("particles/spin", "rad/s", "angular velocities ω", store.spins()));
  if (setup.gas == GasForce::relaxed) {
    std::vector<Vec3> debts;
    for (const GasResponse& response : store.gas_response) debts.push_back(response.debt);
    content.arrays.push_back(rows("particles/gas_debt", "N·s", "received from the gas beyond what the gas has lost", debts));
  }
  const auto end = static_cast<std::ptrdiff_t>(n);
  const auto integers = [&](const char* name, const char* meaning, const auto& values) {
    content.arrays.push_back(
        {name, "", meaning, std::vector<std::int64_t>(values.begin(), values.begin() + end), std::nullopt, 1});
  };
  integers("particles/id", "identity, for life", store.id);
  if (setup.types.size() > 1) integers("particles/type", "place among the case's types", store.type);
  if (setup.types.size() > 1 || setup.distributed()) {
    std::vector<double> radii(n);
    for (std::size_t p = 0; p < n; ++p) radii[p] = radius_of(setup.types, store, p);
    content.arrays.push_back({"particles/radius", "m", "radii", std::move(radii), std::nullopt, 1});
  }
  content.arrays.push_back(rows("particles/position_at_rebuild", "m",
                                "centres when the pair list was last built, as the ranks hold them",
                                dem_->positions_at_rebuild()));
  if (setup.verlet) {
    std::vector<Vec3> forces(n), torques(n);
    std::vector<double> known(n);
    for (std::size_t p = 0; p < n; ++p) {
      forces[p] = store.previous[p].force;
      torques[p] = store.previous[p].torque();
      known[p] = store.previous[p].known;
    }
    content.arrays.push_back(rows("particles/contact_force", "N", "by contacts in the last sub-step", forces));
    content.arrays.push_back(rows("particles/contact_torque", "N m", "by contacts in the last sub-step", torques));
    content.arrays.push_back(
        {"particles/contact_known", "1", "0: the particle has made no sub-step", std::move(known), std::nullopt, 1});
  }
}

// What contacts remember. A memory that the laws do not keep is 0.
void Simulation::put_contacts(CheckpointContent& content) const {
  std::vector<std::int64_t> pair_ids, wall_ids;
  std::vector<Vec3> pair_displacements, pair_angles, wall_displacements, wall_angles;
  for (const PairHistory& pair : dem_->pair_histories()) {
    pair_ids.insert(pair_ids.end(), {pair.low, pair.high});
    pair_displacements.push_back(pair.memory.displacement);
    pair_angles.push_back(pair.memory.angle);
  }
  for (const WallHistory& wall : dem_->wall_histories()) {
    wall_ids.insert(wall_ids.end(), {wall.id, wall.wall});
    wall_displacements.push_back(wall.memory.displacement);
    wall_angles.push_back(wall.memory.angle);
  }
  content.arrays.push_back({"contacts/pair", "", "ids of the two particles, lower first", std::move(pair_ids), std::nullopt, 2});
  content.arrays.push_back(
      rows("contacts/pair_displacement", "m", "tangential displacement ξ as the lower id sees it", pair_displacements));
  content.arrays.push_back(rows("contacts/pair_angle", "rad", "rolling angle θ as the lower id sees it", pair_angles));
  content.arrays.push_back(
      {"contacts/wall", "",
       "id of the particle; 2·direction + side of a face of the box, from 6 on walls and directions of contact",
       std::move(wall_ids), std::nullopt, 2});
  content.arrays.push_back(
      rows("contacts/wall_displacement", "m", "tangential displacement ξ as the particle sees it", wall_displacements));
  content.arrays.push_back(rows("contacts/wall_angle", "rad", "rolling angle θ as the particle sees it", wall_angles));
}

void Simulation::require_same(const CheckpointSource& from, const std::string& name, const std::string& field, double here) {
  const double there = from.number(name);
  if (std::abs(there - here) <= 1e-12 * std::abs(here)) return;
  throw Stop(Reason::invalid_case, "the checkpoint is of another scene: " + field + " is " + short_number(there) + " there and " +
                                       short_number(here) + " in the case");
}

void Simulation::require_same_box(const CheckpointSource& from) const {
  for (int d = 0; d < 3; ++d) {
    const std::string axis(1, "xyz"[d]);
    require_same(from, "domain/size_" + axis, "domain.size." + axis, plan_.scene.size[d]);
  }
}

void Simulation::require_same_particles(const CheckpointSource& from) const {
  require_same(from, "particles/diameter", "the largest diameter", plan_.scene.particles->largest());
  require_same(from, "particles/types", "the number of types", static_cast<double>(dem_->setup().types.size()));
}

void Simulation::restore(const CheckpointSource& from) {
  require_same_box(from);
  for (int d = 0; d < 3; ++d) {
    const std::string axis(1, "xyz"[d]);
    require_same(from, "cells/" + axis, "domain.cells." + axis, plan_.scene.cells[d]);
  }
  if (from.has("gas/pressure") != static_cast<bool>(gas_) || from.has("particles/position") != static_cast<bool>(dem_)) {
    throw Stop(Reason::invalid_case, "the checkpoint is of another scene: gas and particles must be there in both or in neither");
  }
  if (dem_) require_same_particles(from);
  steps_ = from.step();
  time_ = from.time();
  controller_.restore(from.number("controller/step_size"), static_cast<int>(from.number("controller/good_steps")));
  last_step_ = from.number("controller/last_step");
  if (gas_) restore_gas(from);
  if (dem_) restore_particles(from);
}

void Simulation::restore_gas(const CheckpointSource& from) {
  GasState& gas = gas_->state;
  gas_->solver.prepare(gas, time_);
  read_grid(from, "gas/pressure", gas.pressure, part_of(gas_->grid));
  read_grid(from, "gas/fraction", gas.fraction, part_of(gas_->grid));
  for (int d = 0; d < 3; ++d) {
    read_grid(from, velocity_names[d], gas.velocity[d], part_of(gas_->grid, d));
    gas.fall[d] = from.number(fall_names[d]);
  }
  gas_->halo.fill(gas.pressure);
  gas_->halo.fill(gas.fraction);
  gas_->halo.fill(gas.velocity);
  if (coupling_) coupling_->transfer.mirror_at_faces(gas.fraction);
}

void Simulation::seed_from(const CheckpointSource& packing) {
  if (!dem_ || !packing.has("particles/position")) {
    throw Stop(Reason::invalid_case, dem_ ? "the checkpoint whose packing is to be taken has no particles"
                                          : "the case has no particles to take from a packing");
  }
  require_same_box(packing);
  require_same_particles(packing);
  begin_gas();
  ParticleStore store = particles_of(packing);
  store.each_array(dem_->setup(), [&](auto& array) { array.resize(store.owned); });
  const std::int64_t highest = store.owned ? *std::ranges::max_element(store.id) : -1;
  const auto next_id = static_cast<std::int64_t>(decomposition_.comm().max(static_cast<double>(highest))) + 1;
  begin_particles(redistribute(decomposition_, dem_->setup(), std::move(store)), next_id);
  if (coupling_) coupling_->transfer.deposit_volume(dem_->particles(), gas_->state.fraction);
}

// Places, velocities and kinds, as the ranks of now read them.
ParticleStore Simulation::particles_of(const CheckpointSource& from) const {
  ParticleStore store;
  const std::vector<Vec3> positions = vectors(from.rows("particles/position"));
  const std::vector<Vec3> velocities = vectors(from.rows("particles/velocity"));
  const std::vector<Vec3> spins =
      from.has("particles/spin") ? vectors(from.rows("particles/spin")) : std::vector<Vec3>(positions.size());
  const std::vector<std::int64_t> ids = from.integer_rows("particles/id");
  const DemSetup& setup = dem_->setup();
  const auto types = setup.types.size() > 1 ? from.integer_rows("particles/type") : std::vector<std::int64_t>(ids.size());
  const auto radii = setup.distributed() ? from.rows("particles/radius") : std::vector<double>(ids.size());
  for (std::size_t p = 0; p < ids.size(); ++p)
    store.add(setup, ids[p], positions[p], velocities[p], spins[p], static_cast<int>(types[p]), radii[p]);
  return store;
}

void Simulation::restore_particles(const CheckpointSource& from) {
  const bool same_blocks = blocks_of(from, decomposition_.comm()) == decomposition_.cuts();
  const DemSetup& setup = dem_->setup();
  ParticleStore store = particles_of(from);
  if (setup.gas == GasForce::relaxed) {
    store.gas_force.resize(store.owned);
    store.gas_response.resize(store.owned);
    if (from.has("particles/gas_debt")) {
      const std::vector<Vec3> debts = vectors(from.rows("particles/gas_debt"));
      for (std::size_t p = 0; p < store.owned; ++p) store.gas_response[p].debt = debts[p];
    }
  }
  if (setup.verlet && from.has("particles/contact_force")) {
    const std::vector<Vec3> forces = vectors(from.rows("particles/contact_force"));
    const std::vector<Vec3> torques = vectors(from.rows("particles/contact_torque"));
    const std::vector<double> known = from.rows("particles/contact_known");
    store.previous.resize(store.owned);
    for (std::size_t p = 0; p < store.owned; ++p) {
      store.previous[p].add(forces[p], torques[p]);
      store.previous[p].known = known[p];
    }
  }
  std::vector<Vec3> at_rebuild;
  if (same_blocks) at_rebuild = vectors(from.rows("particles/position_at_rebuild"));
  if (!same_blocks) {
    store.each_array(setup, [&](auto& array) { array.resize(store.owned); });
    store = redistribute(decomposition_, setup, std::move(store));
  }

  std::vector<PairHistory> pairs;
  std::vector<WallHistory> walls;
  if ((setup.history || setup.rolling_history) && from.has("contacts/pair")) {
    const std::vector<std::int64_t> pair_ids = from.integer_rows("contacts/pair"), wall_ids = from.integer_rows("contacts/wall");
    const std::vector<Vec3> pair_displacements = vectors(from.rows("contacts/pair_displacement"));
    const std::vector<Vec3> pair_angles = vectors(from.rows("contacts/pair_angle"));
    const std::vector<Vec3> wall_displacements = vectors(from.rows("contacts/wall_displacement"));
    const std::vector<Vec3> wall_angles = vectors(from.rows("contacts/wall_angle"));
    for (std::size_t c = 0; c < pair_angles.size(); ++c)
      pairs.push_back({pair_ids[2 * c], pair_ids[2 * c + 1], {pair_displacements[c], pair_angles[c]}});
    for (std::size_t c = 0; c < wall_angles.size(); ++c)
      walls.push_back({wall_ids[2 * c], wall_ids[2 * c + 1], {wall_displacements[c], wall_angles[c]}});
  }
  particle_count_ = decomposition_.comm().sum(static_cast<std::int64_t>(store.owned));
  if (plan_.tuned_skin) {
    dem_->set_tuning({from.number("particles/skin"),
                      {static_cast<std::int64_t>(from.number("particles/skin_substeps")),
                       static_cast<std::int64_t>(from.number("particles/skin_rebuilds"))}});
  }
  restore_turnover(from);
  dem_->restore(std::move(store), at_rebuild, pairs, walls);
}

}  // namespace bedflow
