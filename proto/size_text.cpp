#include "size_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace bedflow {

std::string bytes_text(double bytes) {
  constexpr std::array<const char*, 5> units = {"B", "KiB", "MiB", "GiB", "TiB"};
  std::size_t unit = 0;
  for (; bytes >= 1024 && unit + 1 < units.size(); ++unit) bytes /= 1024;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), unit == 0 ? "%.0f %s" : "%.1f %s", bytes, units[unit]);
  return text.data();
}

std::string bytes_text(std::uint64_t bytes) {
  return bytes_text(static_cast<double>(bytes));
}

std::uint64_t bytes_of_text(const std::string& text) {
  static const std::array<std::pair<std::string_view, double>, 9> units = {{{"", 1},
                                                                            {"B", 1},
                                                                            {"KiB", 1024.0},
                                                                            {"MiB", 1024.0 * 1024},
                                                                            {"GiB", 1024.0 * 1024 * 1024},
                                                                            {"TiB", 1024.0 * 1024 * 1024 * 1024},
                                                                            {"MB", 1e6},
                                                                            {"GB", 1e9},
                                                                            {"TB", 1e12}}};
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
  unit.remove_prefix(std::min(unit.find_first_not_of(' '), unit.size()));
  for (const auto& [name, factor] : units) {
    const double bytes = number * factor;
    if (error == std::errc() && unit == name && bytes >= 0 && bytes < 1e18)
      return static_cast<std::uint64_t>(std::llround(bytes));
  }
  throw std::invalid_argument("'" + text + "' is no size: a number and B, KiB, MiB, GiB, TiB, MB, GB or TB, as in 50GiB");
}

}  // namespace bedflow
