#include "guard.h"

#include <cmath>
#include <sstream>
#include <utility>

#include "base/short_number.h"
#include "grid/rows.h"

namespace bedflow {

namespace {

std::string text(Vec3 v) {
  std::ostringstream text;
  text << "(" << short_number(v.x) << ", " << short_number(v.y) << ", " << short_number(v.z) << ")";
  return std::move(text).str();
}
std::string cell_text(const Grid& grid, Int3 cell) {
  Vec3 centre = grid.low;
  std::ostringstream name;
  name << "cell (";
  for (int d = 0; d < 3; ++d) {
    centre[d] += (cell[d] + 0.5) * grid.spacing[d];
    name << grid.first[d] + cell[d] << (d < 2 ? ", " : ")");
  }
  return name.str() + " at " + text(centre) + " m";
}

// Σ|U|/h of the cells of a grid: of each direction the faster of its two faces, 1/s.
class Transport {
 public:
  Transport(const Grid& grid, const FaceField& velocity) {
    for (int d = 0; d < 3; ++d) {
      u_[d] = velocity[d].data();
      stride_[d] = grid.stride(d);
      per_spacing_[d] = 1 / grid.spacing[d];
    }
  }
  double operator()(std::ptrdiff_t c) const { return along(0, c) + along(1, c) + along(2, c); }

 private:
  double along(int d, std::ptrdiff_t c) const {
    return per_spacing_[d] * std::max(std::abs(u_[d][c]), std::abs(u_[d][c + stride_[d]]));
  }
  const double* u_[3];
  std::ptrdiff_t stride_[3];
  Vec3 per_spacing_;
};

// The cell of this block with the largest Σ|U|/h, or one where it is not a number.
Int3 worst_cell(const Grid& grid, const FaceField& velocity) {
  const Transport transport(grid, velocity);
  Int3 worst{};
  double most = 0;
  for (int k = 0; k < grid.cells[2]; ++k)
    for (int j = 0; j < grid.cells[1]; ++j)
      for (int i = 0; i < grid.cells[0]; ++i) {
        const double rate = transport(grid.index(i, j, k));
        if (std::isnan(rate)) return {i, j, k};
        if (rate > most) most = rate, worst = {i, j, k};
      }
  return worst;
}

}  // namespace

double fastest_transport(const Grid& grid, const FaceField& velocity) {
  const Transport transport(grid, velocity);
  double fastest = 0;
  for_rows(grid, [&](auto first, int n) {
    for (auto c = first; c < first + n; ++c) fastest = std::max(fastest, transport(c));
  });
  return fastest;
}

void watch_particles(const GuardSetup& limits, const Dem& dem, double deepest, double substep, Failure& failure) {
  if (!(deepest <= limits.overlap)) {
    const Dem::DeepContact contact = dem.deepest_contact();
    std::string who = contact.overlap > 0 ? "; now the deepest is of particle " + std::to_string(contact.first) +
                                                (contact.second < 0 ? " on a face of the box"
                                                                    : " and particle " + std::to_string(contact.second)) +
                                                " at " + text(contact.place) + " m, " + short_number(contact.overlap)
                                          : std::string();
    failure.note(Reason::diverged, "a contact overlaps by " + short_number(deepest) + " of the radii, guard.overlap is " +
                                       short_number(limits.overlap) + who +
                                       "; a stiffer contact holds it (particles.linear_spring_dashpot.stiffness)");
  }
  const ParticleStore& particles = dem.particles();
  const std::vector<ParticleType>& types = dem.setup().types;
  const double way = limits.move / substep;
  for (std::size_t i = 0; i < particles.owned; ++i) {
    const Vec3 v = particles.velocity(i);
    const double most = way * 2 * radius_of(types, particles, i);
    if (dot(v, v) <= most * most) continue;
    failure.note(Reason::diverged, "particle " + std::to_string(particles.id[i]) + " at " + text(particles.position(i)) +
                                       " m moves at " + text(v) + " m/s, " +
                                       short_number(norm(v) * substep / (2 * radius_of(types, particles, i))) +
                                       " of its diameter in a sub-step, guard.move is " + short_number(limits.move) +
                                       "; more particles.steps_per_collision make the way shorter");
    return;
  }
}

void watch_gas(const GuardSetup& limits, const Grid& grid, const FaceField& velocity, double dt, Failure& failure) {
  const Transport transport(grid, velocity);
  std::int64_t beyond = 0;
  for_rows(grid, [&](auto first, int n) {
    for (auto c = first; c < first + n; ++c) beyond += !(dt * transport(c) <= limits.courant);
  });
  if (beyond == 0) return;
  const Int3 worst = worst_cell(grid, velocity);
  const double courant = dt * transport(grid.index(worst[0], worst[1], worst[2]));
  failure.note(Reason::diverged, "the gas has the Courant number " + short_number(courant) + " in " + cell_text(grid, worst) +
                                     ", guard.courant is " + short_number(limits.courant) + "; a shorter time.step lowers it");
}

void watch_fraction(const GuardSetup& limits, const Grid& grid, const Transfer::Lowest& lowest, Failure& failure) {
  if (lowest.fraction >= limits.gas_fraction) return;
  failure.note(Reason::diverged, "the particles leave the gas " + short_number(lowest.fraction) + " of " +
                                     cell_text(grid, lowest.cell) + ", guard.gas_fraction is " +
                                     short_number(limits.gas_fraction) + "; wider cells or a wider kernel spread them");
}

}  // namespace bedflow
