#include "case_file.h"

#include <google/protobuf/text_format.h>
#include <google/protobuf/util/json_util.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "case_parser.h"
#include "case_rules.h"
#include "case_walker.h"
#include "coarse_graining.h"
#include "fidelity.h"
#include "mesh_file.h"
#include "parameter_text.h"
#include "sphere_table.h"

namespace bedflow {
namespace {

constexpr std::size_t most_faults = 200;  // a list beyond that helps nobody, and must fit into a status

void shorten(std::vector<CaseFault>& faults) {
  if (faults.size() <= most_faults) return;
  const std::size_t more = faults.size() - most_faults;
  faults.resize(most_faults);
  faults.push_back({"case", "has " + std::to_string(more) + " more faults: correct these first"});
}

void check_rules(const v1::Case& value, std::vector<CaseFault>& faults) {
  check_scene(value, faults);
  check_faces(value, faults);
  check_flow(value, faults);
  check_particles(value, faults);
  check_contacts(value, faults);
  check_seeding(value, faults);
  check_walls(value, faults);
  check_monitors(value, faults);
}

bool is_json(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string::npos && text[first] == '{';
}

// folder: where files that the case names are looked for; null: nowhere.
CaseRead read_case_text(const std::string& text, const std::filesystem::path* folder) {
  CaseParse parse = is_json(text) ? parse_case_json(text) : parse_case_text(text);
  CaseRead result{std::move(parse.value), std::move(parse.faults)};
  if (parse.read_to_end) {
    complete(result.value);
    if (folder != nullptr) {
      const bool spheres = inline_sphere_tables(result.value, *folder, result.faults);
      const bool meshes = inline_mesh_files(result.value, *folder, result.faults);
      if (!spheres || !meshes) return result;
    }
    for (CaseFault& fault : check_case(result.value)) result.faults.push_back(std::move(fault));
  }
  shorten(result.faults);
  return result;
}

}  // namespace

CaseRead read_case(const std::string& text) {
  return read_case_text(text, nullptr);
}

CaseRead read_case_file(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (file && !std::filesystem::is_directory(path)) text << file.rdbuf();
  if (!file || std::filesystem::is_directory(path)) {
    const std::string why = std::filesystem::is_directory(path) ? "is a folder" : std::strerror(errno);
    return {{}, {{path.string(), "cannot be read: " + why + "; give the path of a case file ('bedflow init' writes one)"}}};
  }
  const std::filesystem::path folder = path.parent_path();
  return read_case_text(text.str(), &folder);
}

std::vector<CaseFault> check_case(const v1::Case& value) {
  std::vector<CaseFault> faults = walk_case(value);
  check_rules(value, faults);
  check_coarse_graining(value, faults);
  if (faults.empty() && value.particles().has_coarse_graining()) {
    check_rules(parcels_of(value), faults);
    const std::string why =
        "; these are parcels, particles.coarse_graining.factor = " + number_text(value.particles().coarse_graining().factor()) +
        " times as wide as the particles";
    for (auto& fault : faults) fault.text += why;
  }
  shorten(faults);
  return faults;
}

std::string case_text(const v1::Case& value) {
  google::protobuf::TextFormat::Printer printer;
  printer.SetUseUtf8StringEscaping(true);
  std::string text;
  printer.PrintToString(value, &text);
  return text;
}

std::string case_json(const v1::Case& value) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(value, &text, options);
  if (!status.ok()) throw std::invalid_argument("the case has no JSON: " + status.ToString());
  return text;
}

}  // namespace bedflow
