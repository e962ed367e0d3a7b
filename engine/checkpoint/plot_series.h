// The list of a run's plot files with their times, in ParaView's file series format (JSON).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace bedflow {

// <kind>_<step, 10 digits>.hdf
std::string plot_name(const std::string& kind, std::uint64_t step);

// Ends folder/<kind>.hdf.series with the file of this step, in one stroke (rewritten and renamed): what was listed from this step
// on is taken out, and such files of later steps are removed. Throws Stop: disk_full, internal.
void append_to_series(const std::filesystem::path& folder, const std::string& kind, std::uint64_t step, double time);

}  // namespace bedflow
