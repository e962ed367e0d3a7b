// The cases that `bedflow init` writes, and the presets: sets of models that can be laid over any case.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "bedflow/v1/case.pb.h"

namespace bedflow {

struct ReadyCase {
  std::string_view name;
  std::string_view description;  // one line
};

std::vector<ReadyCase> ready_cases();  // short names of a bed's middle condition ("link") come last
std::vector<ReadyCase> ready_presets();

// Text format, with the comments that teach. An unknown name throws std::out_of_range with the names there are.
std::string ready_case_text(std::string_view name);
std::string preset_text(std::string_view name);

// The case, with a preset laid over it unless that is empty. The preset's laws replace the case's; numbers that both laws
// name alike (a friction coefficient) are kept; what the preset says of parts that the case lacks is left out. Such a case may
// use what is not built yet: check_case tells. An unknown name throws std::out_of_range with the names there are.
v1::Case ready_case(std::string_view name, std::string_view preset = "");

// Makes `wanted`, an arm of one of the choices of `part`, the one that is chosen. Numbers that it and the arm of before name
// alike are kept.
void choose_law(google::protobuf::Message& part, const google::protobuf::FieldDescriptor& wanted);

}  // namespace bedflow
