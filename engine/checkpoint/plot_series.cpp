#include "checkpoint/plot_series.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <optional>
#include <string_view>
#include <vector>

#include "checkpoint/posix_file.h"

namespace bedflow {

namespace fs = std::filesystem;

namespace {

// The step of the file that a line of a series names; nothing for another line.
std::optional<std::uint64_t> step_in_line(std::string_view line, const std::string& kind) {
  const std::string before = "\"" + kind + "_";
  const std::size_t place = line.find(before);
  if (place == std::string_view::npos) return std::nullopt;
  std::uint64_t step = 0;
  const char* const first = line.data() + place + before.size();
  const auto [end, error] = std::from_chars(first, line.data() + line.size(), step);
  return error == std::errc() && std::string_view(end, line.data() + line.size()).starts_with(".hdf\"") ? std::optional(step)
                                                                                                        : std::nullopt;
}

std::string shortest(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

}  // namespace

std::string plot_name(const std::string& kind, std::uint64_t step) {
  const std::string digits = std::to_string(step);
  return kind + "_" + std::string(10 - std::min<std::size_t>(digits.size(), 10), '0') + digits + ".hdf";
}

void append_to_series(const fs::path& folder, const std::string& kind, std::uint64_t step, double time) {
  const fs::path series = folder / (kind + ".hdf.series"), rewritten = folder / (kind + ".hdf.series.partial");
  std::string entries;
  std::vector<fs::path> outdated;
  std::ifstream old(series);
  for (std::string line; std::getline(old, line);) {
    const std::optional<std::uint64_t> listed = step_in_line(line, kind);
    if (!listed) continue;
    if (*listed > step) outdated.push_back(folder / plot_name(kind, *listed));
    if (*listed >= step || !fs::exists(folder / plot_name(kind, *listed))) continue;
    entries += line.substr(0, line.find('}')) + "},\n";
  }
  entries += "    {\"name\": \"" + plot_name(kind, step) + "\", \"time\": " + shortest(time) + "}\n";
  check_room(folder, entries.size() + 4096);
  std::ofstream out(rewritten, std::ios::trunc);
  out << "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n" << entries << "  ]\n}\n";
  out.close();
  if (!out) throw Stop(Reason::internal, "cannot write " + rewritten.string());
  rename_for_good(rewritten, series);
  std::error_code ignored;
  for (const fs::path& path : outdated) fs::remove(path, ignored);
}

}  // namespace bedflow
