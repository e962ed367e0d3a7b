#include "terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <map>
#include <string_view>

namespace bedflow::client {

namespace {

std::string_view variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

bool utf8_locale() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const auto value = variable(name);
    if (value.empty()) continue;
    return value.find("UTF-8") != value.npos || value.find("utf8") != value.npos || value.find("UTF8") != value.npos;
  }
  return false;
}

template <class... Values>
std::string printed(const char* format, Values... values) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

}  // namespace

Terminal::Terminal(std::FILE* stream) : stream_(stream) {
  interactive_ = isatty(fileno(stream)) == 1 && variable("TERM") != "dumb";
  colour_ = interactive_ && variable("NO_COLOR").empty();
  unicode_ = utf8_locale();
}

int Terminal::width() const {
  winsize size{};
  return ioctl(fileno(stream_), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

std::string Terminal::paint(Colour colour, const std::string& text) const {
  if (!colour_) return text;
  constexpr std::array<const char*, 6> codes = {"1", "2", "31", "32", "33", "36"};
  return std::string("\033[") + codes[static_cast<std::size_t>(colour)] + "m" + text + "\033[0m";
}

void say(const std::string& line) {
  std::fputs((line + "\n").c_str(), stderr);
}

std::size_t display_width(const std::string& text) {
  std::size_t columns = 0;
  bool control = false;
  for (const char c : text) {
    if (c == '\033') control = true;
    const bool continuation = (static_cast<unsigned char>(c) & 0xC0) == 0x80;
    if (!control && !continuation) ++columns;
    if (control && c == 'm') control = false;
  }
  return columns;
}

std::string duration_text(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0) return "?";
  if (seconds < 10) return printed("%.1f s", seconds);
  const auto whole = std::llround(seconds);
  if (whole < 60) return printed("%lld s", whole);
  if (whole < 3600) return printed("%lldm %02llds", whole / 60, whole % 60);
  if (whole < 48 * 3600) return printed("%lldh %02lldm", whole / 3600, whole / 60 % 60);
  return printed("%lldd %02lldh", whole / 86400, whole / 3600 % 24);
}

std::optional<double> seconds_of_text(const std::string& text) {
  static const std::map<std::string, double> units = {{"", 1}, {"s", 1}, {"min", 60}, {"m", 60}, {"h", 3600}, {"d", 86400}};
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const auto unit = units.find(std::string(end, text.data() + text.size()));
  if (error != std::errc() || unit == units.end() || !std::isfinite(number) || number <= 0) return std::nullopt;
  return number * unit->second;
}

std::string time_text(std::int64_t unix_nanos) {
  if (unix_nanos == 0) return "-";
  const std::time_t seconds = unix_nanos / 1'000'000'000;
  std::tm local{};
  localtime_r(&seconds, &local);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S", &local);
  return text.data();
}

std::string number_text(double value) {
  return printed("%.6g", value);
}

}  // namespace bedflow::client
