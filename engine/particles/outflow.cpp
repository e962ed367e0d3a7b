#include "particles/outflow.h"

namespace bedflow {

Departed take_departed_particles(Vec3 size, const DemSetup& setup, ParticleStore& particles, ContactHistory& history) {
  if (!setup.has_outlet()) return {};
  const auto departed = [&](Vec3 x) {
    for (int d = 0; d < 3; ++d) {
      if (x[d] < 0 && setup.sides[d][0] == Side::outlet) return true;
      if (x[d] > size[d] && setup.sides[d][1] == Side::outlet) return true;
    }
    return false;
  };
  Departed gone;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < particles.owned; ++i) {
    if (departed(particles.position(i))) {
      const double mass = mass_of(setup.types, particles, i);
      gone.amount.add(mass);
      gone.momentum += mass * particles.velocity(i);
      if (!particles.gas_response.empty()) gone.debt += particles.gas_response[i].debt;
      continue;
    }
    if (kept < i) {
      particles.each_array(setup, [&](auto& array) { array[kept] = array[i]; });
      history.heads()[kept] = history.heads()[i];
    }
    ++kept;
  }
  particles.each_array(setup, [&](auto& array) { array.resize(kept); });
  history.heads().resize(kept);
  particles.owned = kept;
  return gone;
}

}  // namespace bedflow
