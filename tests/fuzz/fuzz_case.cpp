// Any text as a case, text format or JSON: faults, or a case that is the same when it is written and read again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "case_file.h"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto read = bedflow::read_case(std::string(reinterpret_cast<const char*>(data), size));
  if (!read.faults.empty()) return 0;
  const auto again = bedflow::read_case(bedflow::case_text(read.value));
  if (!again.faults.empty() || bedflow::case_text(again.value) != bedflow::case_text(read.value)) std::abort();
  return 0;
}
