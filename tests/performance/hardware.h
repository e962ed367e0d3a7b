// What one core of this machine can do, measured: the bounds that stand beside the figures.
#pragma once

#include <cstddef>

namespace bedflow {

// Bytes/s of a = b + s c on arrays of so many bytes together; the best of several passes.
double triad_bandwidth(std::size_t bytes);
// Fused multiply-adds count two; 1/s.
double peak_flops();
// Square roots and divisions in turn, of vectors; 1/s.
double peak_roots();

}  // namespace bedflow
