// A number as messages and the plan print it: four digits.
#pragma once

#include <cstdio>
#include <string>

namespace bedflow {

inline std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace bedflow
