#include "plots.h"

#include "checkpoint/plot_file.h"

namespace bedflow {

void write_plot_files(const Comm& comm, const std::filesystem::path& folder, const Simulation& simulation) {
  if (const Grid* grid = simulation.grid()) {
    Simulation::GasPlot gas = simulation.gas_plot();
    write_gas_plot(comm, folder, simulation.steps(), simulation.time(), gas.part, grid->spacing,
                   {{"pressure", "Pa", std::move(gas.pressure)},
                    {"gas_fraction", "1", std::move(gas.fraction)},
                    {"velocity", "m/s", std::move(gas.velocity)}});
  }
  if (const Dem* dem = simulation.particles()) {
    const ParticleStore& store = dem->particles();
    const std::size_t n = store.owned;
    std::vector<double> speed(n), diameter(n);
    for (std::size_t p = 0; p < n; ++p) {
      speed[p] = norm(store.velocity(p));
      diameter[p] = 2 * radius_of(dem->setup().types, store, p);
    }
    std::vector<PlotArray> arrays{
        {"id", "", std::vector<std::int64_t>(store.id.begin(), store.id.begin() + static_cast<std::ptrdiff_t>(n))},
        {"velocity", "m/s", store.velocities()},
        {"speed", "m/s", std::move(speed)},
        {"diameter", "m", std::move(diameter)}};
    if (dem->setup().types.size() > 1)
      arrays.push_back(
          {"type", "", std::vector<std::int64_t>(store.type.begin(), store.type.begin() + static_cast<std::ptrdiff_t>(n))});
    if (dem->setup().rotation) arrays.push_back({"spin", "rad/s", store.spins()});
    write_particle_plot(comm, folder, simulation.steps(), simulation.time(), store.positions(), arrays);
  }
}

}  // namespace bedflow
