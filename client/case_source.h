// Where a case comes from (a file, stdin or the ready cases) and the changes that the command line makes to it.
#pragma once

#include <string>
#include <vector>

#include "bedflow/v1/case.pb.h"
#include "case_file.h"

namespace bedflow::client {

// "particles.random.count=100", "monitors[2].interval=0", "coupling.ergun" (chooses an arm), "fidelity=FAST" (which decides all
// that profiles choose). Throws Failure with the names that the place has.
void set_value(v1::Case& value, const std::string& assignment);

// `where` is a file, "-" for stdin, the name of a ready case, or that and a preset, as in "mueller@mfix-exa-2018". Assignments
// are applied, then everything is checked: throws Failure (usage) with all faults.
v1::Case load_case(const std::string& where, const std::vector<std::string>& assignments = {});

std::string ready_case_names();  // "mueller, goldschmidt, ..."

}  // namespace bedflow::client
