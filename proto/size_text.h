// Sizes as people write and read them.
#pragma once

#include <cstdint>
#include <string>

namespace bedflow {

std::string bytes_text(double bytes);  // "12.3 MiB"
std::string bytes_text(std::uint64_t bytes);
std::uint64_t bytes_of_text(const std::string& text);  // "50GiB", "200 MB", "4096"; throws std::invalid_argument

}  // namespace bedflow
