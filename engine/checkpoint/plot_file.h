// Files that ParaView opens: VTKHDF 1.0 (docs.vtk.org, "VTKHDF File Format"), names ending in .hdf, which ParaView 5.11 knows.
//
//   <folder>/gas_<step, 10 digits>.hdf        cells as an OverlappingAMR of one level and one box: of the types that carry cell
//   data <folder>/particles_<step>.hdf             centres as vertices of an UnstructuredGrid, with point data
//   <folder>/gas.hdf.series, particles.hdf.series   all steps with their times: what to open to see the run as a film
// Values are 32-bit floats, identities 64-bit integers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "base/vec3.h"
#include "checkpoint/checkpoint.h"

namespace bedflow {

// Values of this rank: one a cell (x fastest) or one a particle.
struct PlotArray {
  std::string name;  // as ParaView shows it, e.g. "velocity"
  std::string unit;  // SI
  std::variant<std::vector<double>, std::vector<Vec3>, std::vector<std::int64_t>> values;
};

// Collective; gathered to rank 0. part: this rank's cells; spacing: edges of a cell, m; the box's low corner is the origin.
// Entries of the series from this step on (a run that was resumed earlier) are replaced, and the later files among them removed.
// Throws Stop on every rank alike: disk_full, internal.
void write_gas_plot(const Comm& comm, const std::filesystem::path& folder, std::uint64_t step, double time, const GridPart& part,
                    Vec3 spacing, const std::vector<PlotArray>& cell_arrays);
void write_particle_plot(const Comm& comm, const std::filesystem::path& folder, std::uint64_t step, double time,
                         std::span<const Vec3> positions, const std::vector<PlotArray>& point_arrays);

}  // namespace bedflow
