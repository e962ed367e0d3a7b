// Particles that leave through faces that let them.
#pragma once

#include "particles/history.h"
#include "particles/store.h"
#include "particles/turnover.h"

namespace bedflow {

// Takes out the particles whose centres are beyond a face that lets them leave, with their histories, and closes the gaps, in
// order. The store holds owned particles only. size: of the box, m.
Departed take_departed_particles(Vec3 size, const DemSetup& setup, ParticleStore& particles, ContactHistory& history);

}  // namespace bedflow
