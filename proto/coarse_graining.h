// Coarse-graining: particles joined into parcels, which are computed in their place.
#pragma once

#include "bedflow/v1/case.pb.h"

namespace bedflow {

// The case whose particles are the parcels of particles.coarse_graining; the case itself where that is absent.
//
// A parcel has l times the diameter of its l³ particles (l: factor) and their density. What it keeps of them:
//   - the elastic energy of a volume, so overlap over diameter: k → l k, E and ν stay, τ → l τ (Bierwisch, Kraft, Riedel &
//   Moseler
//     2009, J. Mech. Phys. Solids 57, 10);
//   - the energy that collisions take from a volume in a second: parcels meet l times less often than their particles did, so
//     1 − e² → l (1 − e²) (Lu, Xu, Ge, Yue, Liu & Li 2014, Chem. Eng. Sci. 120, 67). On a wall e stays: so many kilograms hit it
//     in a second, however they are parcelled. Either way e stays if KEEP_RESTITUTION is set;
//   - friction coefficients, and the energy of attraction of a volume: A → l³ A, gaps → l times as wide;
//   - drag: each of its particles feels b at its own diameter (Sakai & Koshizuka 2009, Chem. Eng. Sci. 64, 533); the engine does
//   this.
v1::Case parcels_of(const v1::Case& value);

}  // namespace bedflow
