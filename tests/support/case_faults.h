// How tests speak of the faults of a case.
#pragma once

#include <gmock/gmock.h>

#include <ostream>
#include <string>

#include "case_file.h"

namespace bedflow {

inline std::ostream& operator<<(std::ostream& out, const CaseFault& fault) {
  return out << fault.path << ": " << fault.text;
}

// A fault at this path whose text holds `text`.
inline auto fault_at(const std::string& path, const std::string& text) {
  return testing::AllOf(testing::Field(&CaseFault::path, path), testing::Field(&CaseFault::text, testing::HasSubstr(text)));
}

}  // namespace bedflow
