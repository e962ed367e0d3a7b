// Reading, checking and writing cases. Used by engine, server and client.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bedflow/v1/case.pb.h"

namespace bedflow {

// What is wrong with a case, at a field's path ("particles.linear_spring_dashpot.restitution", "monitors[2].name").
struct CaseFault {
  std::string path;
  std::string text;  // value, unit, allowed range, what to do

  bool operator==(const CaseFault&) const = default;
};

struct CaseRead {
  v1::Case value;
  std::vector<CaseFault> faults;  // empty: a good case
};

// Text format or JSON (told by the first character that is not white space: '{' is JSON). Faults of the parser carry
// line and column in their path ("line 12, column 3"); a case that parses is completed by the profile that it names, and
// checked by check_case.
CaseRead read_case(const std::string& text);
CaseRead read_case_file(const std::filesystem::path& path);  // a file that cannot be read is a fault too

// All faults of a case: first the generic walker over the field options (required, bounds, NaN and infinity, patterns, numbers of
// items, choices), then the rules that join fields (both fields named).
std::vector<CaseFault> check_case(const v1::Case& value);

std::string case_text(const v1::Case& value);  // text format
std::string case_json(const v1::Case& value);

// The parameter reference, printed from the schema alone (Markdown).
std::string parameter_reference();

// Paths of all arms of all choices that this build can run, from the schema ("gas.solver.simple").
std::vector<std::string> built_laws();

}  // namespace bedflow
