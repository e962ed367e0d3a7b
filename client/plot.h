// Series over time and profiles over their place, with 95 % intervals and the case's reference data, as a gnuplot script.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "bedflow/v1/case.pb.h"
#include "bedflow/v1/results.pb.h"

namespace bedflow::client {

// A panel a monitor, in a grid. Expects at least one series or profile.
std::string plot_script(const v1::Statistics& statistics, const std::optional<v1::Case>& value, const std::string& job,
                        const std::filesystem::path& file);

}  // namespace bedflow::client
