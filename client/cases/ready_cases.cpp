#include "cases/ready_cases.h"

#include <google/protobuf/text_format.h>

#include <array>
#include <stdexcept>

#include "case_texts.h"

namespace bedflow {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

struct ShortName {
  std::string_view name;
  std::string_view meant;
  std::string_view description;
};
constexpr std::array<ShortName, 3> short_names{{{"goldschmidt", "goldschmidt-1.5", "short for goldschmidt-1.5"},
                                                {"link", "link-b2", "short for link-b2"},
                                                {"sscp", "sscp-3", "short for sscp-3"}}};

// What the first line of a text says: "# Something." -> "Something."
std::string_view first_line(std::string_view text) {
  return text.substr(2, text.find('\n') - 2);
}

std::vector<ReadyCase> listed(std::span<const CaseText> texts) {
  std::vector<ReadyCase> list;
  for (const CaseText& one : texts) list.push_back({one.name, first_line(one.text)});
  return list;
}

std::string text_of(std::span<const CaseText> texts, std::string_view name, const std::string& kind) {
  std::string known;
  for (const CaseText& one : texts) {
    if (one.name == name) return std::string(one.text);
    known += (known.empty() ? "" : ", ") + std::string(one.name);
  }
  throw std::out_of_range("no " + kind + " is called '" + std::string(name) + "'; there are: " + known);
}

v1::Case parsed(const std::string& text) {
  v1::Case value;
  if (!google::protobuf::TextFormat::ParseFromString(text, &value)) throw std::logic_error("an embedded case does not parse");
  return value;
}

// Numbers that two laws of one choice name alike.
void keep_numbers(const Message& old_law, Message& new_law) {
  for (int i = 0; i < new_law.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* to = new_law.GetDescriptor()->field(i);
    const FieldDescriptor* from = old_law.GetDescriptor()->FindFieldByName(to->name());
    if (from == nullptr || from->cpp_type() != FieldDescriptor::CPPTYPE_DOUBLE || to->cpp_type() != from->cpp_type()) continue;
    if (!old_law.GetReflection()->HasField(old_law, from)) continue;
    new_law.GetReflection()->SetDouble(&new_law, to, old_law.GetReflection()->GetDouble(old_law, from));
  }
}

// Chooses the preset's arm wherever `part` has another one, so that merging then adds the rest.
void change_laws(const Message& preset, Message& part) {
  for (int i = 0; i < part.GetDescriptor()->oneof_decl_count(); ++i) {
    const FieldDescriptor* wanted = preset.GetReflection()->GetOneofFieldDescriptor(preset, part.GetDescriptor()->oneof_decl(i));
    if (wanted != nullptr) choose_law(part, *wanted);
  }
}

void lay_over(v1::Case preset, v1::Case& value) {
  if (!value.has_gas()) preset.clear_gas();
  if (!value.has_particles()) preset.clear_particles();
  if (!value.has_coupling()) preset.clear_coupling();
  if (preset.has_gas()) change_laws(preset.gas(), *value.mutable_gas());
  if (preset.has_particles()) change_laws(preset.particles(), *value.mutable_particles());
  if (preset.has_coupling()) change_laws(preset.coupling(), *value.mutable_coupling());
  value.MergeFrom(preset);
}

}  // namespace

void choose_law(Message& part, const FieldDescriptor& wanted) {
  const auto* reflection = part.GetReflection();
  const FieldDescriptor* present = reflection->GetOneofFieldDescriptor(part, wanted.containing_oneof());
  if (present == &wanted) return;
  std::unique_ptr<Message> old_law;
  if (present != nullptr) {
    old_law.reset(reflection->GetMessage(part, present).New());
    old_law->CopyFrom(reflection->GetMessage(part, present));
  }
  Message& new_law = *reflection->MutableMessage(&part, &wanted);
  if (old_law) keep_numbers(*old_law, new_law);
}

std::vector<ReadyCase> ready_cases() {
  std::vector<ReadyCase> list = listed(case_texts());
  for (const ShortName& one : short_names) list.push_back({one.name, one.description});
  return list;
}

std::vector<ReadyCase> ready_presets() {
  return listed(preset_texts());
}

std::string ready_case_text(std::string_view name) {
  for (const ShortName& one : short_names) {
    if (one.name == name) name = one.meant;
  }
  return text_of(case_texts(), name, "ready case");
}

std::string preset_text(std::string_view name) {
  return text_of(preset_texts(), name, "preset");
}

v1::Case ready_case(std::string_view name, std::string_view preset) {
  v1::Case value = parsed(ready_case_text(name));
  if (preset.empty()) return value;
  lay_over(parsed(preset_text(preset)), value);
  value.set_name(value.name() + "-" + std::string(preset));
  return value;
}

}  // namespace bedflow
