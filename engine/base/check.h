// Our own mistakes: CHECK(condition, values...) in the audit build; nothing elsewhere.
#pragma once

#ifdef BEDFLOW_AUDIT
#include <cstdlib>
#include <iostream>
#define CHECK(condition, ...)                                                                             \
  do {                                                                                                    \
    if (!(condition)) ::bedflow::check_failed(#condition, __FILE__, __LINE__ __VA_OPT__(, ) __VA_ARGS__); \
  } while (false)
namespace bedflow {
template <class... Values>
[[noreturn]] void check_failed(const char* condition, const char* file, int line, const Values&... values) {
  std::cerr << file << ":" << line << ": CHECK(" << condition << ") failed";
  ((std::cerr << "  " << values), ...);
  std::cerr << std::endl;
  std::abort();
}
}  // namespace bedflow
#else
#define CHECK(condition, ...) \
  do {                        \
  } while (false)
#endif
