// Where the cuts between the blocks should stand so that no rank waits for another.
//
// By counts and not by the clock: the same case gives the same cuts, and so the same bits, on any machine and after any resume. A
// block costs what its cells, its particles and their listed pairs cost at the seconds of the plan.
#pragma once

#include <optional>

#include "particles/dem.h"
#include "plan.h"

namespace bedflow {

// Whether these cuts make as many blocks of the plan's cells as there are ranks, none too narrow.
bool fit(const Cuts& cuts, const Plan& plan);

// Cuts whose dearest block is cheaper than the present dearest one by more than what the move costs until it is looked at anew;
// nothing where there are none. dem: null without particles. Collective, the same on all ranks.
std::optional<Cuts> better_cuts(const Decomposition& decomposition, const Plan& plan, const Dem* dem);

}  // namespace bedflow
