// STL files beside a case file.
#pragma once

#include <filesystem>
#include <vector>

#include "case_file.h"

namespace bedflow {

// Puts the triangles of each `mesh.file` of the case, looked for in `folder`, into its mesh, and takes the name out: the case
// then stands alone. False: a file cannot be read; it is added to the faults.
bool inline_mesh_files(v1::Case& value, const std::filesystem::path& folder, std::vector<CaseFault>& faults);

}  // namespace bedflow
