// What the terminal can do: colour, width, and the signs that its character set has.
#pragma once

#include <cstdio>
#include <optional>
#include <string>

#include "size_text.h"

namespace bedflow::client {

enum class Colour { bold, dim, red, green, yellow, cyan };

class Terminal {
 public:
  explicit Terminal(std::FILE* stream);
  bool interactive() const { return interactive_; }
  bool unicode() const { return unicode_; }
  int width() const;  // columns; 80 if it cannot be told
  // Plain unless the stream is a terminal and NO_COLOR is not set (no-color.org).
  std::string paint(Colour colour, const std::string& text) const;

 private:
  std::FILE* stream_;
  bool interactive_ = false;
  bool colour_ = false;
  bool unicode_ = false;
};

// A line on stderr: messages never go where the data goes.
void say(const std::string& line);

std::size_t display_width(const std::string& text);  // columns of UTF-8 text without control sequences

// "1h 02m", "3m 05s", "12 s"; of a length of time in seconds.
std::string duration_text(double seconds);
// "90" (s), "45s", "30min" or "30m", "2h", "1.5d": above 0; nothing when it is none of these.
std::optional<double> seconds_of_text(const std::string& text);
std::string time_text(std::int64_t unix_nanos);  // local time "2026-01-31 13:05:09"; "-" for 0
// Six significant digits, the shortest form.
std::string number_text(double value);

}  // namespace bedflow::client
