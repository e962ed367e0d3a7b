#include "stl.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>

#include "parameter_text.h"

namespace bedflow {

namespace {

constexpr std::size_t binary_header = 84, binary_triangle = 50;
constexpr double thinnest = 1e-6;  // height over longest edge: below, the normal of single-precision corners is noise

bool finite(const StlTriangle& triangle) {
  bool result = true;
  for (const StlPoint& corner : triangle)
    for (const double x : corner) result = result && std::isfinite(x);
  return result;
}

StlRead refuse(const std::string& why) {
  return {{}, why};
}

StlRead not_finite(std::size_t triangle) {
  return refuse("triangle " + std::to_string(triangle) + " has a coordinate that is not a finite number");
}

std::uint32_t binary_count(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  return count;
}

StlRead read_binary(std::string_view bytes) {
  StlRead result;
  for (std::size_t at = binary_header; at < bytes.size(); at += binary_triangle) {
    float row[12];  // normal, then three corners
    std::memcpy(row, bytes.data() + at, sizeof row);
    StlTriangle triangle;
    for (int k = 0; k < 3; ++k) triangle[k] = {row[3 + 3 * k], row[4 + 3 * k], row[5 + 3 * k]};
    if (!finite(triangle)) return not_finite(result.triangles.size() + 1);
    result.triangles.push_back(triangle);
  }
  return result;
}

class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}
  std::string_view next() {
    const std::size_t begin = std::min(text_.find_first_not_of(" \t\r\n"), text_.size());
    const std::size_t end = std::min(text_.find_first_of(" \t\r\n", begin), text_.size());
    line_ += std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(begin), '\n');
    const std::string_view word = text_.substr(begin, end - begin);
    text_.remove_prefix(end);
    return word;
  }
  bool next_number(double& value) {
    std::string_view word = next();
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
  }
  void skip_line() { text_.remove_prefix(std::min(text_.find('\n'), text_.size())); }
  std::ptrdiff_t line() const { return line_; }

 private:
  std::string_view text_;
  std::ptrdiff_t line_ = 1;
};

// Only the corners matter:  facet … outer loop  vertex x y z (three times)  endloop  endfacet; several solids are one.
StlRead read_text(std::string_view bytes) {
  StlRead result;
  Words words(bytes);
  const auto at_line = [&](const std::string& what) { return refuse("line " + std::to_string(words.line()) + ": " + what); };
  StlTriangle triangle{};
  int corners = 0;
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (word == "vertex") {
      if (corners == 3) return at_line("a facet with more than three corners");
      for (double& x : triangle[corners++])
        if (!words.next_number(x)) return at_line("a vertex needs three numbers");
    } else if (word == "endfacet") {
      if (corners != 3) return at_line("a facet with " + std::to_string(corners) + " corners");
      corners = 0;
      if (!finite(triangle)) return not_finite(result.triangles.size() + 1);
      result.triangles.push_back(triangle);
    } else if (word == "solid" || word == "endsolid") {
      words.skip_line();  // its name
    }
  }
  if (corners != 0 || bytes.find("endsolid") == std::string_view::npos) return at_line("the file ends within a solid");
  return result;
}

std::string text(const StlPoint& p) {
  return "(" + number_text(p[0]) + ", " + number_text(p[1]) + ", " + number_text(p[2]) + ")";
}

struct Edge {
  std::vector<std::size_t> along, against;  // triangles that run from its lower to its higher corner, and back
};

bool degenerate(const StlTriangle& t) {
  const auto way = [&](int from, int to) {
    return StlPoint{t[to][0] - t[from][0], t[to][1] - t[from][1], t[to][2] - t[from][2]};
  };
  const auto length2 = [](const StlPoint& v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; };
  const StlPoint a = way(0, 1), b = way(0, 2);
  const StlPoint area{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};  // twice
  return std::sqrt(length2(area)) <= thinnest * std::max({length2(a), length2(b), length2(way(1, 2))});
}

std::string edge_fault(const Edge& edge, bool open_sheet) {
  std::vector<std::size_t> all = edge.along;
  all.insert(all.end(), edge.against.begin(), edge.against.end());
  std::string numbers;
  for (const std::size_t t : all) numbers += (numbers.empty() ? "" : ", ") + std::to_string(t + 1);
  if (all.size() > 2)
    return "belongs to triangles " + numbers + ": more than two meet there (a wall of its own for the other part)";
  if (all.size() == 1) return open_sheet ? "" : "belongs to triangle " + numbers + " alone: a hole";
  if (edge.along.size() != 1) return "belongs to triangles " + numbers + ", which are wound against each other";
  return "";
}

}  // namespace

StlRead read_stl(std::string_view bytes) {
  // The length tells: programs exist that begin a binary file with "solid".
  StlRead result;
  if (bytes.size() >= binary_header && bytes.size() == binary_header + binary_triangle * binary_count(bytes)) {
    result = read_binary(bytes);
  } else if (bytes.substr(0, 5) == "solid") {
    result = read_text(bytes);
  } else if (bytes.size() < binary_header) {
    return refuse("neither begins with 'solid' nor has a binary header of 84 bytes");
  } else {
    return refuse("neither begins with 'solid' nor has the " +
                  std::to_string(binary_header + binary_triangle * binary_count(bytes)) + " bytes of a binary file of " +
                  std::to_string(binary_count(bytes)) + " triangles; it has " + std::to_string(bytes.size()));
  }
  if (result.fault.empty() && result.triangles.empty()) return refuse("holds no triangle");
  return result;
}

std::vector<std::string> mesh_faults(const std::vector<StlTriangle>& triangles, bool open_sheet, std::size_t most) {
  std::vector<std::string> faults;
  std::size_t count = 0;
  const auto note = [&](const std::string& fault) {
    if (++count <= most) faults.push_back(fault);
  };
  std::map<StlPoint, std::size_t> numbers;  // −0 is 0
  std::vector<StlPoint> corners;
  std::map<std::pair<std::size_t, std::size_t>, Edge> edges;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const StlTriangle& triangle = triangles[t];
    if (degenerate(triangle)) {
      note("triangle " + std::to_string(t + 1) + ", " + text(triangle[0]) + " " + text(triangle[1]) + " " + text(triangle[2]) +
           ", has no area");
    }
    std::size_t number[3];
    for (int k = 0; k < 3; ++k) {
      const auto [place, fresh] = numbers.try_emplace(triangle[k], corners.size());
      if (fresh) corners.push_back(triangle[k]);
      number[k] = place->second;
    }
    for (int k = 0; k < 3; ++k) {
      const std::size_t from = number[k], to = number[(k + 1) % 3];
      if (from == to) continue;
      Edge& edge = edges[std::minmax(from, to)];
      (from < to ? edge.along : edge.against).push_back(t);
    }
  }
  for (const auto& [ends, edge] : edges)
    if (const std::string fault = edge_fault(edge, open_sheet); !fault.empty())
      note("edge " + text(corners[ends.first]) + " – " + text(corners[ends.second]) + " " + fault);
  if (count > most) faults.push_back("and " + std::to_string(count - most) + " more");
  return faults;
}

}  // namespace bedflow
