// Modified incomplete Cholesky factorisation without fill-in, MIC(0) (Gustafsson 1978), of the 7-point operator of one block;
// couplings that leave the block are left out (block Jacobi over ranks).
//
//   M = (E⁻¹ + L) E (E⁻¹ + Lᵀ),  L: what is below A's diagonal,  E⁻¹ such that M and A have (nearly) equal row sums.
#pragma once

#include <vector>

#include "gas/seven_point.h"

namespace bedflow {

class IncompleteCholesky {
 public:
  explicit IncompleteCholesky(const Grid& grid);

  void factor(const SevenPoint& matrix);
  // z = M⁻¹ r. The ghosts of z are 0 and stay so.
  void apply(const SevenPoint& matrix, const Field& r, Field& z);

 private:
  const Grid& grid_;
  Field pivot_;  // E; ghosts 0
  std::vector<double> row_, carry_;
};

}  // namespace bedflow
