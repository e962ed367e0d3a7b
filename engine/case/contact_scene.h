// The contact laws of a case.
#pragma once

#include <string>
#include <vector>

#include "bedflow/v1/case.pb.h"
#include "particles/laws.h"
#include "particles/store.h"

namespace bedflow {

// A type of particles, as far as contacts ask.
struct ContactType {
  std::string name;
  ParticleType type;
  double smallest_radius = 0;  // m
};

// The laws of the case for each pair of types and each type on a wall, pairs and walls with parameters of their own included.
ContactLaws contact_laws(const v1::Case& from, const std::vector<ContactType>& types);
// The normal law of the case with another restitution, between particles and on walls.
ContactLaw contact_law_with(const v1::Case& from, const std::vector<ContactType>& types, double restitution);
// τ, s: the shortest over pairs and walls and the smallest particles.
double collision_time(const v1::Case& from, const ContactLaw& law, const std::vector<ContactType>& types);

}  // namespace bedflow
