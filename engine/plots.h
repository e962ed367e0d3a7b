// The scene as files for ParaView.
#pragma once

#include <filesystem>

#include "parallel/comm.h"
#include "simulation.h"

namespace bedflow {

// Collective. gas_<step>.hdf and particles_<step>.hdf, as far as the scene has them, and their .hdf.series. Throws
// Stop(disk_full).
void write_plot_files(const Comm& comm, const std::filesystem::path& folder, const Simulation& simulation);

}  // namespace bedflow
