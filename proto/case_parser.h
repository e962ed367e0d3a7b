// Text or JSON -> Case, with the parser's faults in words that say what to do.
#pragma once

#include <string>
#include <vector>

#include "case_file.h"

namespace bedflow {

struct CaseParse {
  v1::Case value;
  std::vector<CaseFault> faults;
  bool read_to_end = false;  // all of the text was understood, but for fields that do not exist
};

CaseParse parse_case_text(const std::string& text);
CaseParse parse_case_json(const std::string& text);

}  // namespace bedflow
