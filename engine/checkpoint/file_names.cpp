#include "checkpoint/file_names.h"

#include <algorithm>
#include <charconv>
#include <string_view>

namespace bedflow {

namespace {

// The number between the two texts, when that is all there is.
template <class Number>
std::optional<Number> number_between(std::string_view text, std::string_view before, std::string_view after) {
  if (!text.starts_with(before) || !text.ends_with(after) || text.size() <= before.size() + after.size()) return std::nullopt;
  text = text.substr(before.size(), text.size() - before.size() - after.size());
  Number number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string stem(std::uint64_t step) {
  const std::string digits = std::to_string(step);
  return "checkpoint_" + std::string(10 - std::min<std::size_t>(digits.size(), 10), '0') + digits;
}

}  // namespace

std::string checkpoint_name(std::uint64_t step) {
  return stem(step) + ".h5";
}
std::string kept_name(std::uint64_t step) {
  return checkpoint_name(step) + ".kept";
}
std::string partial_name(std::uint64_t step, std::uint32_t epoch) {
  return stem(step) + ".epoch" + std::to_string(epoch) + ".partial";
}
std::optional<std::uint64_t> step_of_checkpoint(const std::filesystem::path& path) {
  return number_between<std::uint64_t>(path.filename().string(), "checkpoint_", ".h5");
}
std::optional<std::uint32_t> attempt_of_partial(const std::filesystem::path& path) {
  const std::string name = path.filename();
  const std::size_t dot = name.find('.');
  if (dot == std::string::npos || !name.starts_with("checkpoint_")) return std::nullopt;
  return number_between<std::uint32_t>(std::string_view(name).substr(dot), ".epoch", ".partial");
}

std::uint64_t newest_attempt(const std::filesystem::path& job) {
  std::uint64_t newest = 0;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(job / "attempts", none)) {
    newest = std::max(newest, number_between<std::uint64_t>(entry.path().filename().string(), "", "").value_or(0));
  }
  return newest;
}

}  // namespace bedflow
