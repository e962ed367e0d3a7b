// Tables of particles beside a case file: a line with the names of the columns, then one line a particle.
#pragma once

#include <filesystem>
#include <vector>

#include "case_file.h"

namespace bedflow {

// Appends the lines of each `placed.file` of the case, looked for in `folder`, to its spheres, and takes the name out: the case
// then stands alone. False: something cannot be read; it is added to the faults, by table and line.
bool inline_sphere_tables(v1::Case& value, const std::filesystem::path& folder, std::vector<CaseFault>& faults);

}  // namespace bedflow
