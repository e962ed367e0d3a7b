#include "folder.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <system_error>

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

template <class Number>
std::optional<Number> whole_number(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return number;
}

// The numbers that `take` finds in the names of a folder.
template <class Number>
std::vector<Number> numbers_in(const fs::path& folder, const std::function<std::optional<Number>(const std::string&)>& take) {
  std::vector<Number> found;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(folder, missing)) {
    if (const auto number = take(entry.path().filename().string())) found.push_back(*number);
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::uint64_t> steps_in(const fs::path& folder) {
  auto steps = numbers_in<std::uint64_t>(folder, [](const std::string& name) -> std::optional<std::uint64_t> {
    if (name.size() < 24 || !name.starts_with("checkpoint_") || !name.ends_with(".h5")) return std::nullopt;
    return whole_number<std::uint64_t>(std::string_view(name).substr(11, name.size() - 14));
  });
  std::reverse(steps.begin(), steps.end());
  return steps;
}

}  // namespace

DraftFolder::DraftFolder(std::filesystem::path path) : folder(std::move(path)) {
  std::filesystem::create_directories(folder.checkpoints());
  std::filesystem::create_directories(folder.attempts());
}
DraftFolder::~DraftFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(folder.root(), ignored);
}

std::string JobFolder::checkpoint_name(std::uint64_t step) {
  char name[48];
  std::snprintf(name, sizeof name, "checkpoint_%010llu.h5", static_cast<unsigned long long>(step));
  return name;
}

std::vector<std::uint64_t> JobFolder::checkpoint_steps() const {
  return steps_in(checkpoints());
}

std::vector<std::uint64_t> JobFolder::pinned_steps() const {
  return steps_in(pinned());
}

std::vector<std::uint32_t> JobFolder::epochs() const {
  return numbers_in<std::uint32_t>(attempts(), [](const std::string& name) { return whole_number<std::uint32_t>(name); });
}

void JobFolder::command(v1::Control::Command command, bool skip_checkpoint) const {
  v1::Control last;
  read_message(control(), last);
  v1::Control next;
  next.set_sequence(last.sequence() + 1);
  next.set_command(command);
  if (skip_checkpoint) next.set_skip_checkpoint(true);
  write_durably(control(), next);
}

void put_beside(const fs::path& file, const fs::path& name) {
  std::error_code failed;
  fs::create_hard_link(file, name, failed);
  if (!failed || failed == std::errc::file_exists) return;
  if (failed == std::errc::no_such_file_or_directory) throw fs::filesystem_error("linking", file, failed);
  const fs::path part = name.string() + ".partial";
  fs::copy_file(file, part, fs::copy_options::overwrite_existing);
  fs::rename(part, name);
}

bool read_message(const fs::path& path, google::protobuf::Message& message) {
  const std::string text = read_text(path);
  google::protobuf::TextFormat::Parser parser;
  parser.AllowUnknownField(true);
  return !text.empty() && parser.ParseFromString(text, &message);
}

std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string last_lines(const fs::path& path, std::size_t bytes) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return {};
  const auto size = static_cast<std::size_t>(file.tellg());
  file.seekg(static_cast<std::streamoff>(size - std::min(size, bytes)));
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (size > bytes) text.erase(0, text.find('\n') == std::string::npos ? 0 : text.find('\n') + 1);
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

}  // namespace bedflow::server
