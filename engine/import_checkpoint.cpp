#include "import_checkpoint.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <string>
#include <unordered_set>

#include "case/case_scene.h"
#include "checkpoint/checkpoint.h"
#include "scene.h"

namespace bedflow {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& why) {
  throw Stop(Reason::checkpoint_corrupt, why);
}
[[noreturn]] void differ(const std::string& why) {
  throw Stop(Reason::invalid_case, "the checkpoint does not fit the case that it carries: " + why);
}

// ------------------------------------------------------------------------------------------------------ the arrays

// Words for people, as far as they are text: nothing but UTF-8 without control characters.
std::string words_of(const std::string& text) {
  std::size_t following = 0;  // bytes of the present character still to come
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool continues = (byte & 0xC0) == 0x80;
    if (byte < 0x20 || byte == 0x7F || byte >= 0xF5 || continues != (following > 0)) return {};
    following = continues ? following - 1 : byte >= 0xF0 ? 3 : byte >= 0xE0 ? 2 : byte >= 0xC2 ? 1 : 0;
    if (!continues && byte >= 0x80 && byte < 0xC2) return {};
  }
  return following == 0 ? text : std::string();
}

CheckpointArray array_of(const CheckpointReader& from, const Dataset& dataset) {
  CheckpointArray array{dataset.name, words_of(dataset.unit), words_of(dataset.meaning), {}, {}, 1};
  if (dataset.type == Dataset::Type::byte) {
    array.values = from.text(dataset.name);
  } else if (dataset.shape.size() == 3) {
    GridPart part;
    for (std::size_t d = 0; d < 3; ++d)
      part.global[d] = static_cast<int>(std::min<std::uint64_t>(dataset.shape[2 - d], 1U << 30));
    part.count = part.global;
    if (dataset.type != Dataset::Type::real) refuse(dataset.name + " is a grid of integers");
    array.values = from.grid(dataset.name, part);
    array.part = part;
  } else {
    if (dataset.type == Dataset::Type::real) array.values = from.rows(dataset.name);
    if (dataset.type == Dataset::Type::integer) array.values = from.integer_rows(dataset.name);
    array.columns = dataset.shape.size() == 2 ? static_cast<int>(std::min<std::uint64_t>(dataset.shape[1], 1U << 30)) : 1;
  }
  return array;
}

// The first rows of the ranks that wrote an array, which ascend from 0 to the number of its rows.
std::vector<std::int64_t> offsets_of(const CheckpointReader& from, const Dataset& dataset) {
  std::vector<std::int64_t> offsets = from.integer_rows(dataset.name);
  if (offsets.size() != static_cast<std::size_t>(from.ranks()) + 1 || offsets.front() != 0 ||
      !std::is_sorted(offsets.begin(), offsets.end())) {
    refuse(dataset.name + " is not the offsets of " + std::to_string(from.ranks()) + " ranks");
  }
  return offsets;
}

CheckpointContent content_of(const CheckpointReader& from) {
  CheckpointContent content;
  content.step = from.step();
  content.time = from.time();
  content.ranks = from.ranks();
  constexpr int most_ranks = 100'000;
  if (content.ranks < 1 || content.ranks > most_ranks) refuse("it is of " + std::to_string(content.ranks) + " ranks");
  if (content.step > 9'999'999'999) refuse("its step is " + std::to_string(content.step));
  if (!(content.time >= 0 && content.time < 1e18)) refuse("its time is " + std::to_string(content.time) + " s");
  content.numbers = from.numbers();
  content.numbers.erase("time");
  for (const auto& [name, value] : content.numbers) {
    const auto is_of_a_name = [](char c) {
      return std::islower(static_cast<unsigned char>(c)) || std::isdigit(static_cast<unsigned char>(c)) || c == '/' || c == '_';
    };
    if (name.size() > 100 || !std::all_of(name.begin(), name.end(), is_of_a_name))
      refuse("one of its numbers has a name that none has");
    if (!std::isfinite(value)) refuse("its number " + name + " is not finite");
  }
  for (const Dataset& dataset : from.datasets()) {
    const std::string of = "rank_offsets/";
    if (!dataset.name.starts_with(of)) {
      content.arrays.push_back(array_of(from, dataset));
      continue;
    }
    if (content.arrays.empty() || dataset.name != of + content.arrays.back().name)
      refuse(dataset.name + " does not follow its array");
    content.arrays.back().rank_offsets = offsets_of(from, dataset);
  }
  return content;
}

// ------------------------------------------------------------------------------------------ the arrays and the case

class Fit {
 public:
  Fit(const CheckpointContent& content, const Scene& scene) : content_(content), scene_(scene) {}

  void check() {
    for (int d = 0; d < 3; ++d) {
      const std::string axis(1, "xyz"[d]);
      same("domain/size_" + axis, scene_.size[d]);
      same("cells/" + axis, scene_.cells[static_cast<std::size_t>(d)]);
    }
    for (const CheckpointArray& array : content_.arrays) check_array(array);
    if (scene_.gas) check_gas();
    if (!scene_.gas && find("gas/pressure")) differ("it has gas, the case has none");
    if (scene_.particles) check_particles();
    if (!scene_.particles && find("particles/position")) differ("it has particles, the case has none");
  }

 private:
  const CheckpointArray* find(const std::string& name) const {
    for (const CheckpointArray& array : content_.arrays)
      if (array.name == name) return &array;
    return nullptr;
  }
  template <class Value>
  const std::vector<Value>& values(const std::string& name) const {
    const CheckpointArray* array = find(name);
    if (!array) differ("it has no " + name);
    const auto* values = std::get_if<std::vector<Value>>(&array->values);
    if (!values) refuse(name + " has the wrong type of numbers");
    return *values;
  }
  void same(const std::string& name, double wanted) const {
    const auto number = content_.numbers.find(name);
    if (number == content_.numbers.end()) refuse("it has no number " + name);
    if (std::abs(number->second - wanted) > 1e-12 * std::abs(wanted))
      differ(name + " is " + std::to_string(number->second) + ", the case says " + std::to_string(wanted));
  }

  void check_array(const CheckpointArray& array) const {
    if (const auto* reals = std::get_if<std::vector<double>>(&array.values)) {
      if (!std::all_of(reals->begin(), reals->end(), [](double value) { return std::isfinite(value); }))
        refuse(array.name + " has values that are not finite");
    }
    const std::size_t size = std::visit([](const auto& all) { return all.size(); }, array.values);
    const bool text = std::holds_alternative<std::string>(array.values);
    if (array.part || text) return;
    const std::size_t rows = size / static_cast<std::size_t>(std::max(array.columns, 1));
    if (array.rank_offsets.empty() || array.rank_offsets.back() != static_cast<std::int64_t>(rows))
      refuse("rank_offsets/" + array.name + " does not end with its number of rows, " + std::to_string(rows));
  }

  void check_gas() const {
    const auto check_grid = [&](const std::string& name, int faces) {
      values<double>(name);
      Int3 shape = scene_.cells;
      if (faces >= 0) ++shape[static_cast<std::size_t>(faces)];
      const CheckpointArray& array = *find(name);
      if (!array.part || array.part->global != shape) differ(name + " has not the grid of the case");
    };
    check_grid("gas/pressure", -1);
    check_grid("gas/fraction", -1);
    for (int d = 0; d < 3; ++d) check_grid(std::string("gas/velocity_") + "xyz"[d], d);
    for (const double fraction : values<double>("gas/fraction"))
      if (!(fraction > 0 && fraction <= 1 + 1e-9)) refuse("gas/fraction has the value " + std::to_string(fraction));
  }

  // Rows of so many columns, one a particle.
  template <class Value>
  void one_each(const std::string& name, std::size_t columns) const {
    if (values<Value>(name).size() != columns * particles_ || find(name)->columns != static_cast<int>(columns))
      refuse(name + " has not " + std::to_string(columns) + " values for each of the " + std::to_string(particles_) +
             " particles");
  }

  void check_particles() {
    const auto& positions = values<double>("particles/position");
    particles_ = positions.size() / 3;
    same("particles/diameter", scene_.particles->largest());
    same("particles/types", static_cast<double>(scene_.particles->types.size()));
    same("particles/count", static_cast<double>(particles_));
    same("inlets/count", static_cast<double>(scene_.particles->inlets.size()));
    for (const char* name : {"position", "velocity", "position_at_rebuild"})
      one_each<double>("particles/" + std::string(name), 3);
    for (const char* name : {"particles/spin", "particles/gas_debt", "particles/contact_force", "particles/contact_torque"})
      if (find(name)) one_each<double>(name, 3);
    one_each<std::int64_t>("particles/id", 1);
    const double reach = 2 * scene_.particles->largest();
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const double box = scene_.size[static_cast<int>(i % 3)];
      if (positions[i] < -reach || positions[i] > box + reach)
        refuse("particles/position has a centre at " + std::to_string(positions[i]) + " m, outside the box");
    }
    const auto& ids = values<std::int64_t>("particles/id");
    ids_.insert(ids.begin(), ids.end());
    if (ids_.size() != ids.size() || std::any_of(ids.begin(), ids.end(), [](std::int64_t id) { return id < 0; }))
      refuse("particles/id has identities twice, or below 0");
    if (scene_.particles->types.size() > 1) check_types();
    if (find("particles/radius")) check_radii();
    if (find("contacts/pair")) check_contacts();
  }

  void check_types() const {
    one_each<std::int64_t>("particles/type", 1);
    const auto count = static_cast<std::int64_t>(scene_.particles->types.size());
    for (const std::int64_t type : values<std::int64_t>("particles/type"))
      if (type < 0 || type >= count) refuse("particles/type has the value " + std::to_string(type));
  }
  void check_radii() const {
    one_each<double>("particles/radius", 1);
    const double most = 0.5 * scene_.particles->largest() * (1 + 1e-9);
    for (const double radius : values<double>("particles/radius"))
      if (!(radius > 0 && radius <= most)) refuse("particles/radius has the value " + std::to_string(radius) + " m");
  }
  void check_contacts() const {
    const auto check = [&](const std::string& kind, bool both) {
      const auto& rows = values<std::int64_t>("contacts/" + kind);
      for (const char* memory : {"_displacement", "_angle"})
        if (values<double>("contacts/" + kind + memory).size() * 2 != rows.size() * 3)
          refuse("contacts/" + kind + memory + " has not one row for each contact");
      for (std::size_t i = 0; i < rows.size(); i += both ? 1 : 2)
        if (!ids_.contains(rows[i]))
          refuse("contacts/" + kind + " names a particle " + std::to_string(rows[i]) + " that is not there");
    };
    check("pair", true);
    check("wall", false);
  }

  const CheckpointContent& content_;
  const Scene& scene_;
  std::size_t particles_ = 0;
  std::unordered_set<std::int64_t> ids_;
};

}  // namespace

void import_checkpoint(const fs::path& file, const fs::path& folder) {
  const CheckpointReader from(Comm::self(), file);
  const CheckpointContent content = content_of(from);
  const auto is_case = [](const CheckpointArray& array) { return array.name == "case"; };
  const auto found = std::find_if(content.arrays.begin(), content.arrays.end(), is_case);
  const auto* text = found == content.arrays.end() ? nullptr : std::get_if<std::string>(&found->values);
  constexpr std::size_t longest_case = 4 << 20;
  if (!text || text->size() > longest_case) refuse("it carries no case");
  const Scene scene = scene_of(*text);  // of the text alone: no files that it may name
  Fit(content, scene).check();
  const fs::path case_file = folder / "case.txtpb";
  if (!(std::ofstream(case_file, std::ios::binary) << *text).flush())
    throw Stop(Reason::disk_full, "cannot write " + case_file.string());
  write_checkpoint(Comm::self(), folder / "checkpoints", content, 2);
}

}  // namespace bedflow
