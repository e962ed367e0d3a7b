// Convection beyond upwind, as a correction that the equations take as given: implicit upwind keeps the matrix that of upwind,
// and |F| (u_face − u_upstream) of the present velocity stands in the source (Khosla & Rubin 1974). Over the outer iterations it
// goes to the scheme itself; where a step is one solve it is that of the step's start, second order in space all the same.
#include "gas/momentum.h"

namespace bedflow {

void Momentum::correct_convection(int d, const double* u) {
  std::visit(
      [&]<class Scheme>(const Scheme& scheme) {
        if constexpr (!std::is_same_v<Scheme, Upwind>)
          for (int t = 0; t < 3; ++t) correct_along(scheme, d, t, u);
      },
      setup_.convection);
}

// Sides in direction t of the control volumes of component d: the low side of a volume has its index. Sides on a face of the box
// bring the boundary's own velocity, or carry that of the cell before them: nothing is missing there.
template <class Scheme>
void Momentum::correct_along(const Scheme& scheme, int d, int t, const double* u) {
  const std::ptrdiff_t s = grid_.stride(t), across = grid_.stride(d);
  const double* flux = flux_[t].data();
  double *correction = correction_.data(), *source = source_.data();
  const Int3 low = low_solved(d), high = high_solved(d);
  Int3 first = low, end = high;  // sides
  ++end[t];
  const auto without = [&](int side) {
    Int3 from = first, to = end;
    from[t] = side;
    to[t] = side + 1;
    for_rows(grid_, from, to, [=](auto c, int n) { std::fill_n(correction + c, n, 0.0); });
  };
  if (t == d ? boundaries_.outflow(t, 0) : boundaries_.at(t, 0) != nullptr) without(first[t]++);
  if (t == d ? boundaries_.outflow(t, 1) : boundaries_.at(t, 1) != nullptr) without(--end[t]);

  const auto sides = [=, this](Int3 from, Int3 to, double before, double after) {  // shares of the two fluxes of a side
    for_rows(grid_, from, to, [=](auto start, int n) {
#pragma GCC ivdep
      for (auto c = start; c < start + n; ++c) {
        const double through = before * flux[c - across] + after * flux[c];
        const double behind = through > 0 ? u[c - s] - u[c - 2 * s] : u[c + s] - u[c];
        correction[c] = std::abs(through) * scheme(behind, u[c] - u[c - s]);
      }
    });
  };
  // Across an outflow the control volumes are half ones, with half the sides.
  Int3 from = first, to = end;
  if (t != d && boundaries_.outflow(d, 0)) {
    Int3 edge = to;
    edge[d] = 1;
    sides(from, edge, 0, 0.5);
    from[d] = 1;
  }
  if (t != d && boundaries_.outflow(d, 1)) {
    Int3 edge = from;
    edge[d] = --to[d];
    Int3 edge_end = end;
    sides(edge, edge_end, 0.5, 0);
  }
  sides(from, to, 0.5, 0.5);

  for (const std::ptrdiff_t side : panels_.beside[d][t]) correction[side] = 0;
  for_rows(grid_, low, high, [=](auto start, int n) {
#pragma GCC ivdep
    for (auto c = start; c < start + n; ++c) source[c] += correction[c] - correction[c + s];
  });
}

}  // namespace bedflow
