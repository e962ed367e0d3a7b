// Case -> types, sizes and places of particles.
#pragma once

#include <vector>

#include "bedflow/v1/case.pb.h"
#include "particles/insertion.h"
#include "particles/seeding.h"

namespace bedflow {

int type_index(const v1::Particles& particles, const std::string& name);  // -1: of none

std::vector<SeedKind> seed_kinds(const v1::Particles& particles);

using TypeShares = google::protobuf::RepeatedPtrField<v1::TypeShare>;
// Shares by number of all kinds; `named`: those that take part, all by their own shares if it is empty.
std::vector<double> kind_shares(const v1::Particles& particles, const std::vector<SeedKind>& kinds, const TypeShares& named);

std::vector<SeedRegion> seed_regions(const v1::Case& from, const std::vector<SeedKind>& kinds);

// Of all faces.
std::vector<Inlet> particle_inlets(const v1::Case& from, const std::vector<SeedKind>& kinds);

// Of the seeding, whichever way it is told; null: none is asked for.
const v1::Settling* settling_of(const v1::Particles& particles);

}  // namespace bedflow
