#include "vary.h"

#include <google/protobuf/message.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "case_source.h"
#include "cases/ready_cases.h"
#include "failure.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

enum class Finer { larger, smaller };
struct KnownAxis {
  const char* name;
  const char* path;
  Finer finer;
  const char* meaning;
};
constexpr std::array known_axes = {
    KnownAxis{"steps_per_collision", "particles.steps_per_collision", Finer::larger, "sub-steps in a collision"},
    KnownAxis{"substeps", "time.substeps", Finer::smaller, "sub-steps in a gas step, dt_CFD/dt_DEM"},
    KnownAxis{"gas_step", "time.step", Finer::smaller, "gas step dt_CFD, s"},
    KnownAxis{"stiffness", "particles.contact.stiffness", Finer::larger, "of the contacts, as in x0.1"},
    KnownAxis{"cells", "domain.cells", Finer::larger, "of the grid in each direction, as in x0.5"},
    KnownAxis{"tolerance", "gas.solver.tolerance", Finer::smaller, "of SIMPLE's outer iterations, as in x0.1"},
    KnownAxis{"tangential", "particles.tangential", Finer::larger, "frictionless, coulomb, spring, mindlin"},
    KnownAxis{"integrator", "particles.integrator", Finer::larger, "symplectic_euler, velocity_verlet"},
    KnownAxis{"kernel", "coupling.kernel", Finer::larger, "between particles and grid"},
    KnownAxis{"exchange", "coupling.exchange", Finer::larger, "explicit, substepped, semi_implicit"},
    KnownAxis{"convection", "gas.convection", Finer::larger, "upwind, smart, superbee"},
    KnownAxis{"solver", "gas.solver", Finer::larger, "simple, projection"},
    KnownAxis{"displacement", "coupling.displacement", Finer::larger, "true, false: ∂ε/∂t in the gas"},
    KnownAxis{"coarse_graining", "particles.coarse_graining.factor", Finer::smaller,
              "diameter of parcels over that of particles"},
    KnownAxis{"fidelity", "fidelity", Finer::larger, "FAST, BALANCED, REFERENCE: a profile of all that profiles choose"},
    // what the field's codes call them
    KnownAxis{"coupling.substeps", "time.substeps", Finer::smaller, ""},
    KnownAxis{"dem.steps_per_collision", "particles.steps_per_collision", Finer::larger, ""},
};

const KnownAxis* known(const std::string& axis) {
  const auto found = std::ranges::find_if(known_axes, [&](const auto& one) { return axis == one.name || axis == one.path; });
  return found == known_axes.end() ? nullptr : &*found;
}

[[noreturn]] void refuse(const std::string& axis, const std::string& why, const std::string& next = "bedflow study --knobs") {
  throw Failure(Exit::usage, "--vary " + axis + ": " + why, next);
}

std::vector<std::string> parts_of(const std::string& path) {
  std::vector<std::string> parts(1);
  for (const char c : path) {
    if (c == '.')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

const google::protobuf::OneofDescriptor* choice_of(const Message& message, const std::string& name) {
  return message.GetDescriptor()->FindOneofByName(name);
}

// The path with the names of choices within it replaced by the laws that the case has chosen: what --set understands.
std::string through_choices(const v1::Case& value, const std::string& axis, const std::vector<std::string>& parts) {
  std::string path;
  const Message* message = &value;
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
    std::string part = parts[i];
    if (const auto* choice = choice_of(*message, part)) {
      const auto* arm = message->GetReflection()->GetOneofFieldDescriptor(*message, choice);
      if (arm == nullptr) refuse(axis, "the case chooses nothing for " + path + part);
      part = arm->name();
    }
    path += part + ".";
    const auto* field = message->GetDescriptor()->FindFieldByName(part);
    if (field == nullptr || field->is_repeated() || field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE)
      return path + parts.back();  // --set says what is wrong with it, or knows lists
    message = &message->GetReflection()->GetMessage(*message, field);
  }
  return path + parts.back();
}

Message& block_of(v1::Case& value, const std::string& axis, const std::string& path) {
  Message* message = &value;
  auto parts = parts_of(path);
  parts.pop_back();
  for (const auto& part : parts) {
    const auto* field = message->GetDescriptor()->FindFieldByName(part);
    if (field == nullptr || field->is_repeated() || field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE)
      refuse(axis, "there is no block \"" + part + "\" in it", "bedflow reference");
    message = message->GetReflection()->MutableMessage(message, field);
  }
  return *message;
}

void multiply(Message& message, const FieldDescriptor& field, double factor, const std::string& axis) {
  const auto* reflection = message.GetReflection();
  const auto whole = [&](double number) { return static_cast<std::uint32_t>(std::max(1.0, std::round(number * factor))); };
  switch (field.is_repeated() ? FieldDescriptor::CPPTYPE_STRING : field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return reflection->SetDouble(&message, &field, reflection->GetDouble(message, &field) * factor);
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection->SetUInt32(&message, &field, whole(reflection->GetUInt32(message, &field)));
    case FieldDescriptor::CPPTYPE_MESSAGE: {
      Message& inner = *reflection->MutableMessage(&message, &field);
      for (int i = 0; i < inner.GetDescriptor()->field_count(); ++i) {
        const auto& each = *inner.GetDescriptor()->field(i);
        if (inner.GetReflection()->HasField(inner, &each)) multiply(inner, each, factor, axis);
      }
      return;
    }
    default:
      refuse(axis, "\"" + field.name() + "\" is no number to multiply");
  }
}

std::optional<double> factor_of(const std::string& setting) {
  if (!setting.starts_with("x")) return std::nullopt;
  double factor = 0;
  const char* end = setting.data() + setting.size();
  const auto [rest, error] = std::from_chars(setting.data() + 1, end, factor);
  if (error != std::errc() || rest != end || !(factor > 0) || !std::isfinite(factor)) return std::nullopt;
  return factor;
}

// "stiffness" is spelt by each law in its own way.
std::string spelt(const v1::Case& value, const std::string& path) {
  if (path != "particles.contact.stiffness") return path;
  return value.particles().has_hertz() ? "particles.hertz.youngs_modulus" : "particles.linear_spring_dashpot.stiffness";
}

double number_of(const std::string& setting) {
  const std::string text = setting.starts_with("x") ? setting.substr(1) : setting;
  double number = NAN;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && rest == text.data() + text.size() ? number : NAN;
}

}  // namespace

Axis parse_axis(const std::string& text) {
  const auto equals = text.find('=');
  Axis axis;
  axis.name = text.substr(0, equals);
  if (equals == text.npos || equals == 0) refuse(text, "not of the form NAME=VALUE,VALUE,...");
  std::string setting;
  for (const char c : text.substr(equals + 1) + ",") {
    if (c != ',') {
      setting += c;
      continue;
    }
    if (setting.empty()) refuse(text, "has an empty value");
    if (std::ranges::count(axis.values, setting)) refuse(text, "has the value " + setting + " twice");
    axis.values.push_back(setting);
    setting.clear();
  }
  return axis;
}

void vary(v1::Case& value, const std::string& axis, const std::string& setting) {
  const auto* knob = known(axis);
  const std::string named = spelt(value, knob ? knob->path : axis);
  const std::string path = through_choices(value, axis, parts_of(named));
  const std::string last = parts_of(path).back();
  const auto factor = factor_of(setting);
  if (path.find('[') == path.npos) {
    Message& block = block_of(value, axis, path);
    if (const auto* choice = choice_of(block, last)) {
      const auto* arm = block.GetDescriptor()->FindFieldByName(setting);
      if (arm == nullptr || arm->containing_oneof() != choice) {
        std::string names;
        for (int i = 0; i < choice->field_count(); ++i) names += (i ? ", " : "") + choice->field(i)->name();
        refuse(axis, setting + " is none of " + names);
      }
      return choose_law(block, *arm);
    }
    const auto* field = block.GetDescriptor()->FindFieldByName(last);
    if (factor && field != nullptr) return multiply(block, *field, *factor, axis);
  }
  set_value(value, path + "=" + setting);
  if (path == "time.substeps") value.mutable_time()->clear_step();
  if (path == "time.step") value.mutable_time()->clear_substeps();
}

std::size_t finest(const Axis& axis) {
  const auto* knob = known(axis.name);
  std::vector<double> numbers;
  for (const auto& setting : axis.values) numbers.push_back(number_of(setting));
  if (knob == nullptr || std::ranges::any_of(numbers, [](double number) { return std::isnan(number); })) {
    throw Failure(Exit::usage, "which value of " + axis.name + " is the finest cannot be told",
                  "bedflow study ... --reference " + axis.name + "=" + axis.values.back());
  }
  const auto best = knob->finer == Finer::larger ? std::ranges::max_element(numbers) : std::ranges::min_element(numbers);
  return static_cast<std::size_t>(best - numbers.begin());
}

std::vector<Knob> knobs() {
  std::vector<Knob> list;
  for (const auto& one : known_axes)
    if (*one.meaning) list.push_back({one.name, one.path, one.meaning});
  return list;
}

}  // namespace bedflow::client
