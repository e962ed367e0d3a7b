#include "energy_watch.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "base/short_number.h"

namespace bedflow {

namespace {

std::string fastest_text(const Dem& dem) {
  const ParticleStore& particles = dem.particles();
  std::size_t fastest = 0;
  for (std::size_t i = 1; i < particles.owned; ++i)
    if (norm(particles.velocity(i)) > norm(particles.velocity(fastest))) fastest = i;
  if (particles.owned == 0) return "";
  const Vec3 x = particles.position(fastest);
  std::ostringstream text;
  text << "; the fastest is particle " << particles.id[fastest] << " at (" << short_number(x.x) << ", " << short_number(x.y)
       << ", " << short_number(x.z) << ") m, " << short_number(norm(particles.velocity(fastest))) << " m/s";
  return std::move(text).str();
}

}  // namespace

void EnergyWatch::prepare(Dem& dem) {
  if (limit_ > 0 && steps_ == 0) dem.open_energy_account();
}

void EnergyWatch::look(const Dem& dem, const Comm& comm, Failure& failure) {
  if (limit_ == 0) return;
  const Dem::Energy& account = dem.energy_account();
  const bool attracts = dem.setup().range > 0;
  steps_ = (steps_ + 1) % (attracts ? 1 : span);
  const double created = comm.sum(attracts ? account.created : account.given - account.stored);
  if (!(created > 0)) return;  // or no number: whose that is, others say
  const double energy = comm.sum(dem.kinetic_energy() + account.stored);
  if (created <= limit_ * energy) return;
  failure.note(Reason::diverged,
               "contacts have created " + short_number(created) + " J, " + short_number(created / energy) +
                   " of the kinetic and the stored energy, guard.energy is " + short_number(limit_) + fastest_text(dem) +
                   "; a motion too coarse for its contacts: more particles.steps_per_collision, with Hertz a faster " +
                   "impact_speed" + (attracts ? ", or a larger van_der_waals.nearest" : ""));
}

}  // namespace bedflow
