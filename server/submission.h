// What CreateJob is asked to run, checked: the case by its schema, the specification, and the engine's own plan.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bedflow/v1/service.pb.h"

namespace bedflow::server {

// All faults of the specification, paths below "spec".
std::vector<v1::Fault> check_spec(const v1::JobSpec& spec, std::uint32_t slots);

// All faults of the case by its schema; a case with fields that this server does not know is refused too.
std::vector<v1::Fault> check_case_fields(const v1::Case& value);

// What the engine would run. Throws Refusal: invalid_case with the engine's faults, backend_error when it cannot be asked.
v1::PlanReport plan_of(const std::filesystem::path& engine, const std::filesystem::path& case_file, std::uint32_t ranks);

}  // namespace bedflow::server
