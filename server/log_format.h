// How the server's log looks: a line for people, or a JSON object a line for what collects logs.
#pragma once

#include <spdlog/formatter.h>

#include <memory>
#include <string>
#include <string_view>

namespace bedflow::server {

// {"time": "…Z", "level": "info", "message": "…", "job": "j-…"}; job where the message names one.
class JsonLines final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override;
  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<JsonLines>(); }
};

// The first job that a text names; empty: none.
std::string_view job_named_in(std::string_view text);

void set_up_log(const std::string& format);  // "text" or "json"

}  // namespace bedflow::server
