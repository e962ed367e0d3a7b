// What CreateJob is asked to run, checked: the case by its schema, and the specification. The engine's plan: planner.h.
#pragma once

#include <cstdint>
#include <vector>

#include "bedflow/v1/service.pb.h"
#include "queue.h"

namespace bedflow::server {

// All faults of the specification, paths below "spec".
std::vector<v1::Fault> check_spec(const v1::JobSpec& spec, const Capacities& executors);

// All faults of the case by its schema; a case with fields that this server does not know is refused too.
std::vector<v1::Fault> check_case_fields(const v1::Case& value);

// Both, of a job to be. Throws Refusal(invalid_case) with all faults.
void require_sound(const v1::CreateJobRequest& request, const Capacities& executors);

}  // namespace bedflow::server
