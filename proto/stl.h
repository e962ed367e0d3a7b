// Triangles from an STL file, text or binary, and what is wrong with them as a wall.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace bedflow {

using StlPoint = std::array<double, 3>;
using StlTriangle = std::array<StlPoint, 3>;

struct StlRead {
  std::vector<StlTriangle> triangles;  // in the file's unit; its normals are not used
  std::string fault;                   // why the bytes are no STL file; empty: they are
};
StlRead read_stl(std::string_view bytes);

// Each fault with its triangle (from 1, in the order of the file) or edge and its coordinates: triangles without area, edges that
// belong to one triangle (holes; not in an open sheet), to more than two, or to two that are wound against each other. Corners
// are one where their coordinates are equal. At most `most` are told, and how many more there are.
std::vector<std::string> mesh_faults(const std::vector<StlTriangle>& triangles, bool open_sheet, std::size_t most = 20);

}  // namespace bedflow
