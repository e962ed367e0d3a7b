#include "gas/drive.h"

namespace bedflow {

DrivenFlow::DrivenFlow(const Decomposition& decomposition, const Grid& grid, const GasSetup& setup)
    : decomposition_(decomposition), grid_(grid), setup_(setup), row_sums_{RowSum(grid), RowSum(grid)} {}

void DrivenFlow::set_time(GasState& state, double time) {
  for (int d = 0; d < 3; ++d) {
    const Drive& drive = setup_.drive[d];
    if (!decomposition_.periodic(d)) continue;
    const double share = drive.schedule.at(time);
    if (drive.pressure_drop) state.fall[d] = *drive.pressure_drop * share / decomposition_.size()[d];
    if (drive.mass_flux) wanted_[d] = *drive.mass_flux * share / setup_.density;
  }
}

void DrivenFlow::steer(GasState& state, const FaceField& conductance) {
  const double faces = static_cast<double>(grid_.global[0]) * grid_.global[1] * grid_.global[2];
  for (int d = 0; d < 3; ++d) {
    if (!wanted_[d]) continue;
    const double *epsilon = state.fraction.data(), *through = conductance[d].data();
    const double response_of = grid_.spacing[d] / grid_.face_area(d);
    const std::ptrdiff_t s = grid_.stride(d);
    double *u = state.velocity[d].data(), *flow = row_sums_[0].clear(), *response = row_sums_[1].clear();
    for_rows(grid_, [=](auto c, int n) {
      for (int i = 0; i < n; ++i) {
        flow[i] += 0.5 * (epsilon[c + i - s] + epsilon[c + i]) * u[c + i];
        response[i] += response_of * through[c + i];
      }
    });
    std::array<double, 2> sums{row_sums_[0].total(grid_.cells[0]), row_sums_[1].total(grid_.cells[0])};
    decomposition_.comm().sum(sums);
    const double shift = *wanted_[d] - sums[0] / faces;
    for_rows(grid_, [=](auto c, int n) {
      for (auto i = c; i < c + n; ++i) u[i] += shift / (0.5 * (epsilon[i - s] + epsilon[i]));
    });
    if (sums[1] > 0) state.fall[d] += shift * faces / sums[1];
  }
}

}  // namespace bedflow
