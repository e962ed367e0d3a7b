#include "fidelity.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "case_difference.h"

namespace bedflow {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

v1::Case settings_of(const char* text) {
  v1::Case settings;
  if (!google::protobuf::TextFormat::ParseFromString(text, &settings)) throw std::logic_error("a profile does not parse");
  return settings;
}

// What is set in `message`, each field once.
template <class Visit>
void for_each_field(const Message& message, Visit visit) {
  std::vector<const FieldDescriptor*> fields;
  message.GetReflection()->ListFields(message, &fields);
  for (const auto* field : fields)
    visit(*field, field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE, field->containing_oneof());
}

// Leaves of the settings those that `value` neither has nor has chosen otherwise, and none of blocks that it lacks.
void keep_missing(Message& settings, const Message& value) {
  const auto& reflection = *value.GetReflection();
  for_each_field(settings, [&](const FieldDescriptor& field, bool is_block, const auto* choice) {
    const bool is_there = reflection.HasField(value, &field);
    if (is_there && is_block)
      keep_missing(*reflection.MutableMessage(&settings, &field), reflection.GetMessage(value, &field));
    else if (is_there || (choice ? reflection.HasOneof(value, choice) : is_block))
      reflection.ClearField(&settings, &field);
  });
}

void take_out(const Message& settings, Message& value) {
  const auto& reflection = *value.GetReflection();
  for_each_field(settings, [&](const FieldDescriptor& field, bool is_block, const auto* choice) {
    if (choice)
      reflection.ClearOneof(&value, choice);
    else if (!is_block)
      reflection.ClearField(&value, &field);
    else if (reflection.HasField(value, &field))
      take_out(reflection.GetMessage(settings, &field), *reflection.MutableMessage(&value, &field));
  });
}

// What the case has otherwise than if it left all to the profile.
std::vector<CaseDifference> departures(v1::Case value, const Profile& profile) {
  auto& time = *value.mutable_time();
  if (value.has_particles() && !time.has_step() && !time.has_substeps()) {  // then the step is the collision time
    const double steps = value.particles().steps_per_collision();
    if (steps == std::round(steps)) time.set_substeps(static_cast<std::uint32_t>(steps));
  }
  v1::Case pure = value;
  leave_open(pure);
  pure.set_fidelity(profile.fidelity);
  complete(pure);
  return differences(pure, value);
}

// "upwind {}" -> "upwind"
std::string plain(const std::string& value) {
  return value.ends_with(" {}") ? value.substr(0, value.size() - 3) : value;
}

}  // namespace

const std::vector<Profile>& profiles() {
  static const std::vector<Profile> all = {
      {v1::FAST,
       settings_of(
           "particles { symplectic_euler {} steps_per_collision: 10 } time { substeps: 40 } gas { projection {} superbee {} } "
           "coupling { hat {} explicit {} displacement: true }"),
       "mueller 6.8 x, bed height -0.1 ± 1.8 %; goldschmidt 5.5 x, bed height +1.3 ± 17.7 %, against REFERENCE"},
      {v1::BALANCED,
       settings_of(
           "particles { symplectic_euler {} steps_per_collision: 20 } time { substeps: 20 } gas { simple {} superbee {} } "
           "coupling { hat {} explicit {} displacement: true }"),
       "mueller 3.4 x, bed height -0.2 ± 1.9 %; goldschmidt 2.8 x, bed height -1.4 ± 16.4 %, against REFERENCE"},
      {v1::REFERENCE,
       settings_of("particles { velocity_verlet {} steps_per_collision: 50 } time { substeps: 10 } "
                   "gas { simple { tolerance: 1e-4 } superbee {} } coupling { hat {} explicit {} displacement: true }"),
       "mueller 107 CPU s per simulated s; goldschmidt 254 CPU s per simulated s"},
  };
  return all;
}

void complete(v1::Case& value) {
  if (!value.has_fidelity()) return;
  v1::Case settings = std::ranges::find(profiles(), value.fidelity(), &Profile::fidelity)->settings;
  const bool has_step = value.time().has_step() || !value.has_particles();  // sub-steps are those of particles
  if (has_step) settings.mutable_time()->clear_substeps();
  keep_missing(settings, value);
  value.MergeFrom(settings);
}

void leave_open(v1::Case& value) {
  for (const auto& profile : profiles()) take_out(profile.settings, value);
  if (value.has_particles() && value.has_time()) value.mutable_time()->clear_step();
}

std::string standing_text(const v1::Case& value) {
  const Profile* nearest = nullptr;
  std::vector<CaseDifference> least;
  for (const auto& profile : profiles()) {
    auto otherwise = departures(value, profile);
    const bool is_named = value.fidelity() == profile.fidelity && value.has_fidelity();
    if (nearest && !is_named && (value.has_fidelity() || otherwise.size() >= least.size())) continue;
    nearest = &profile;
    least = std::move(otherwise);
    if (is_named) break;
  }
  const std::string name = v1::Fidelity_Name(nearest->fidelity);
  std::string text = value.has_fidelity() ? name : "none named; nearest to " + name;
  for (std::size_t i = 0; i < least.size(); ++i)
    text += (i ? ", " : ", but ") + least[i].path + " " + plain(least[i].second) + " (" + plain(least[i].first) + ")";
  return text + "; " + name + " as measured: " + nearest->measured;
}

}  // namespace bedflow
