// Profiles of accuracy against speed that a case can name: what it leaves open of the numerics is chosen by its profile. They are
// drawn from studies of published beds (tests/validation/README.md says which and what they found).
#pragma once

#include <string>
#include <vector>

#include "bedflow/v1/case.pb.h"

namespace bedflow {

// Sets what a case that names a profile leaves open; what it says itself stays, and parts that it lacks (gas, particles) stay
// away. Nothing happens without a profile, and nothing the second time.
void complete(v1::Case& value);

// Takes out whatever any profile chooses, so that the one named next decides all of it.
void leave_open(v1::Case& value);

struct Profile {
  v1::Fidelity fidelity;
  v1::Case settings;     // these alone
  const char* measured;  // what it costs and errs, for people; fidelity_test holds it against the study that is kept
};
const std::vector<Profile>& profiles();  // from the fastest on

// Where a case stands, for people: the profile that it names, else the nearest; what it has otherwise; what was measured of it.
std::string standing_text(const v1::Case& value);

}  // namespace bedflow
