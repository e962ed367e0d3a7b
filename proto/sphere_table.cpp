#include "sphere_table.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>

#include "parameter_text.h"

namespace bedflow {
namespace {

constexpr int most_lines = 100000;  // as Placed.spheres
constexpr int most_complaints = 5;  // of one table

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  for (std::size_t start = 0; start <= line.size();) {
    const std::size_t end = std::min(line.find(',', start), line.size());
    cells.push_back(trimmed(line.substr(start, end - start)));
    start = end + 1;
  }
  return cells;
}

struct Column {
  const char* name;
  void (*set)(v1::Sphere&, double);
};
constexpr std::array<Column, 10> columns{{{"x", [](v1::Sphere& s, double v) { s.mutable_position()->set_x(v); }},
                                          {"y", [](v1::Sphere& s, double v) { s.mutable_position()->set_y(v); }},
                                          {"z", [](v1::Sphere& s, double v) { s.mutable_position()->set_z(v); }},
                                          {"vx", [](v1::Sphere& s, double v) { s.mutable_velocity()->set_x(v); }},
                                          {"vy", [](v1::Sphere& s, double v) { s.mutable_velocity()->set_y(v); }},
                                          {"vz", [](v1::Sphere& s, double v) { s.mutable_velocity()->set_z(v); }},
                                          {"wx", [](v1::Sphere& s, double v) { s.mutable_spin()->set_x(v); }},
                                          {"wy", [](v1::Sphere& s, double v) { s.mutable_spin()->set_y(v); }},
                                          {"wz", [](v1::Sphere& s, double v) { s.mutable_spin()->set_z(v); }},
                                          {"diameter", [](v1::Sphere& s, double v) { s.set_diameter(v); }}}};
constexpr const char* column_names = "x, y, z, vx, vy, vz, wx, wy, wz, diameter, type";

class Table {
 public:
  Table(v1::Placed& placed, const std::filesystem::path& folder, const std::string& path, std::vector<CaseFault>& faults)
      : placed_(placed), path_(path + ".file"), file_(folder / placed.file()), faults_(faults) {}

  void read() {
    errno = 0;
    std::ifstream text(file_);
    if (!text || std::filesystem::is_directory(file_)) {
      complain(0, std::string("cannot be read: ") + (errno != 0 ? std::strerror(errno) : "it is a folder"));
      return;
    }
    std::string line;
    int number = 0;
    while (std::getline(text, line) && complaints_ < most_complaints) {
      ++number;
      if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
      if (names_.empty()) {
        read_names(cells_of(line), number);
      } else if (placed_.spheres_size() >= most_lines) {
        complain(number, "is one too many: at most " + std::to_string(most_lines) + " particles can be placed one by one");
        break;
      } else {
        read_sphere(cells_of(line), number);
      }
      if (complaints_ > 0 && names_.empty()) break;
    }
    if (names_.empty() && complaints_ == 0) complain(0, "is empty: its first line names the columns, such as x, y, z");
    if (complaints_ == 0) placed_.clear_file();
  }

 private:
  void complain(int line, const std::string& what) {
    ++complaints_;
    faults_.push_back({path_, "\"" + file_.string() + "\"" + (line > 0 ? ", line " + std::to_string(line) : "") + " " + what});
  }

  void read_names(const std::vector<std::string>& names, int line) {
    for (const std::string& name : names) {
      if (std::ranges::count(names, name) > 1) return complain(line, "names the column \"" + name + "\" twice");
      if (name != "type" && std::ranges::find(columns, name, &Column::name) == columns.end())
        return complain(line, "names a column \"" + name + "\"; there are " + column_names);
    }
    for (const char* needed : {"x", "y", "z"})
      if (std::ranges::count(names, needed) == 0) return complain(line, std::string("names no column ") + needed);
    names_ = names;
  }

  void read_sphere(const std::vector<std::string>& cells, int line) {
    if (cells.size() != names_.size()) {
      return complain(line, "has " + std::to_string(cells.size()) + " values for " + std::to_string(names_.size()) + " columns");
    }
    v1::Sphere& sphere = *placed_.add_spheres();
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (names_[c] == "type") {
        sphere.set_type(cells[c]);
        continue;
      }
      double value = 0;
      const char* end = cells[c].data() + cells[c].size();
      const auto [rest, error] = std::from_chars(cells[c].data(), end, value);
      if (error != std::errc() || rest != end) return complain(line, names_[c] + " is \"" + cells[c] + "\": a number is needed");
      std::ranges::find(columns, names_[c], &Column::name)->set(sphere, value);
    }
  }

  v1::Placed& placed_;
  std::string path_;
  std::filesystem::path file_;
  std::vector<CaseFault>& faults_;
  std::vector<std::string> names_;
  int complaints_ = 0;
};

}  // namespace

bool inline_sphere_tables(v1::Case& value, const std::filesystem::path& folder, std::vector<CaseFault>& faults) {
  if (!value.has_particles()) return true;
  const std::size_t before = faults.size();
  v1::Particles& particles = *value.mutable_particles();
  if (particles.placed().has_file()) Table(*particles.mutable_placed(), folder, "particles.placed", faults).read();
  for (int i = 0; i < particles.composed().regions_size(); ++i) {
    if (!particles.composed().regions(i).placed().has_file()) continue;
    v1::Placed& placed = *particles.mutable_composed()->mutable_regions(i)->mutable_placed();
    Table(placed, folder, item_path("particles.composed.regions", i) + ".placed", faults).read();
  }
  return faults.size() == before;
}

}  // namespace bedflow
