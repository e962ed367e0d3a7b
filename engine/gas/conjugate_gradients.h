// Conjugate gradients for the 7-point operator, with a choice of preconditioners.
//
// Where x is given nowhere it is free by a constant: the right side is made to sum to 0, and x to have no mean.
#pragma once

#include <array>
#include <variant>

#include "gas/incomplete_cholesky.h"
#include "gas/multigrid.h"
#include "gas/workspace.h"
#include "grid/halo.h"
#include "grid/rows.h"

namespace bedflow {

enum class Preconditioner { multigrid, incomplete_cholesky, unpreconditioned };

constexpr const char* name(Preconditioner preconditioner) {  // as in the schema
  constexpr std::array names{"multigrid", "incomplete_cholesky", "unpreconditioned"};
  return names[static_cast<std::size_t>(preconditioner)];
}

class ConjugateGradients {
 public:
  // upright: of the multigrid.
  ConjugateGradients(const Decomposition& decomposition, const Grid& grid, Halo& halo, Preconditioner preconditioner,
                     Workspace& work, int upright = -1);

  // What the preconditioner needs of a new matrix. Collective.
  void factor(const SevenPoint& matrix);
  struct Result {
    int iterations = 0;
    bool reached = false;
  };
  // A x = b from x = 0 until Σ(b − A x)² over all ranks has come down to `target`, or to the square of `reduction` times what it
  // was; b becomes the residual b − A x. x has no ghosts. Neither is one of the workspace's first three. Collective.
  Result solve(const SevenPoint& matrix, bool singular, Field& b, Field& x, double reduction, double target);

 private:
  struct Identity {};
  double dot(const Field& a, const Field& b);
  double multiply(const SevenPoint& matrix);  // product_ = A direction_; returns direction · product, this rank
  void precondition(const SevenPoint& matrix, const Field& r, double magnitude);
  void subtract_mean(Field& field);
  double cells() const { return static_cast<double>(grid_.global[0]) * grid_.global[1] * grid_.global[2]; }

  const Decomposition& decomposition_;
  const Grid& grid_;
  Halo& halo_;
  std::variant<Multigrid, IncompleteCholesky, Identity> preconditioner_;
  Field &preconditioned_, &direction_, &product_;
  RowSum row_sum_;
};

}  // namespace bedflow
