// Particles that change rank, with all that belongs to them.
#pragma once

#include <vector>

#include "parallel/decomposition.h"
#include "particles/history.h"
#include "particles/store.h"

namespace bedflow {

// Hands particles that left this block to the neighbour they went to, across periodic faces to the other side of the box, and
// takes what comes; a particle beyond a face of the box stays. Collective. No particle may have gone further than a block.
// The store holds owned particles only, and does so afterwards, in any order.
void migrate(const Decomposition& decomposition, const DemSetup& setup, ParticleStore& particles, ContactHistory& history);

// Particles anywhere on any rank, to their owners by place. Collective. For a restart on another number of ranks.
ParticleStore redistribute(const Decomposition& decomposition, const DemSetup& setup, ParticleStore particles);

// Histories anywhere on any rank, to every rank that owns a particle of theirs (ids: of this rank's particles). Collective.
void redistribute(const Comm& comm, const std::vector<std::int64_t>& ids, std::vector<PairHistory>& pairs,
                  std::vector<WallHistory>& walls);

}  // namespace bedflow
