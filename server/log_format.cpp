#include "log_format.h"

#include <spdlog/spdlog.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>

#include "security.h"

namespace bedflow::server {
namespace {

void append_quoted(spdlog::memory_buf_t& line, std::string_view text) {
  line.push_back('"');
  for (const char c : text) {
    if (c == '"' || c == '\\') line.push_back('\\');
    if (static_cast<unsigned char>(c) < 0x20) {
      std::array<char, 8> code{};
      std::snprintf(code.data(), code.size(), "\\u%04x", c);
      line.append(code.data(), code.data() + 6);
    } else {
      line.push_back(c);
    }
  }
  line.push_back('"');
}

std::string utc(spdlog::log_clock::time_point time) {
  const auto millis = std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
  const std::time_t seconds = millis / 1000;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  std::array<char, 32> text{}, whole{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  std::snprintf(whole.data(), whole.size(), "%.20s.%03dZ", text.data(), static_cast<int>(millis % 1000));
  return whole.data();
}

}  // namespace

std::string_view job_named_in(std::string_view text) {
  constexpr std::size_t length = 14;  // j- and 12 hex digits
  for (auto place = text.find("j-"); place != text.npos; place = text.find("j-", place + 1)) {
    if (is_job_id(text.substr(place, length))) return text.substr(place, length);
  }
  return {};
}

void JsonLines::format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) {
  const auto append = [&](std::string_view text) { line.append(text.data(), text.data() + text.size()); };
  const std::string_view text(message.payload.data(), message.payload.size());
  const auto level = spdlog::level::to_string_view(message.level);
  append("{\"time\": ");
  append_quoted(line, utc(message.time));
  append(", \"level\": ");
  append_quoted(line, {level.data(), level.size()});
  append(", \"message\": ");
  append_quoted(line, text);
  if (const auto job = job_named_in(text); !job.empty()) {
    append(", \"job\": ");
    append_quoted(line, job);
  }
  append("}\n");
}

void set_up_log(const std::string& format) {
  if (format == "json")
    spdlog::set_formatter(std::make_unique<JsonLines>());
  else
    spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
}

}  // namespace bedflow::server
