// The facets that a grid sees of a smooth surface: one flat polygon for each cell that the surface cuts (the embedded boundary of
// AMReX, as the paper's code takes its walls from it).
//
// In each cell the surface is replaced by its tangent plane at the point that is nearest to the cell's centre. A plane is
// reproduced exactly; a curved surface of radius R by facets that are off by at most (3/8) h²/R in cubes of edge h.
#pragma once

#include "geometry/facet.h"
#include "geometry/surface.h"

namespace bedflow {

// The facets of the cells of `edges` (m) that fill a box of cells[0] × cells[1] × cells[2] from the origin, each polygon as a fan
// of triangles. Where the surface has an edge, its cells hold the plane of the nearer face.
std::vector<Facet> cut_cells(const Surface& surface, std::array<int, 3> cells, Vec3 edges);

}  // namespace bedflow
