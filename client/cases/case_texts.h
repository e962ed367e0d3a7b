// The embedded texts of the ready cases and presets; CMake writes case_texts.cpp.
#pragma once

#include <span>
#include <string_view>

namespace bedflow {

struct CaseText {
  std::string_view name;
  std::string_view text;  // its first line is a comment that says what it is
};

std::span<const CaseText> case_texts();
std::span<const CaseText> preset_texts();

}  // namespace bedflow
