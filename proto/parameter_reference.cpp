// The parameter reference and the list of laws, from the descriptors alone.
#include <google/protobuf/descriptor.h>

#include <algorithm>

#include "case_file.h"
#include "parameter_lines.h"
#include "parameter_text.h"

namespace bedflow {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::OneofDescriptor;

std::string anchor(const std::string& name) {
  std::string text = name;
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return "[" + name + "](#" + text + ")";
}

std::string enum_names(const EnumDescriptor& type) {
  std::string text;
  for (int i = 0; i < type.value_count(); ++i) text += (i > 0 ? ", " : "") + type.value(i)->name();
  return text;
}

std::string type_text(const FieldDescriptor& field) {
  std::string text;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      text = anchor(field.message_type()->name());
      break;
    case FieldDescriptor::CPPTYPE_ENUM:
      text = "name";
      break;
    case FieldDescriptor::CPPTYPE_DOUBLE:
      text = "number";
      break;
    case FieldDescriptor::CPPTYPE_BOOL:
      text = "true or false";
      break;
    case FieldDescriptor::CPPTYPE_STRING:
      text = "text";
      break;
    default:
      text = "whole number";
  }
  return field.is_repeated() ? "list of " + text : text;
}

std::string default_text(const FieldDescriptor& field) {
  if (parameter_of(field).required()) return "required";
  if (!field.has_default_value()) return "";
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return number_text(field.default_value_double());
    case FieldDescriptor::CPPTYPE_UINT32:
      return std::to_string(field.default_value_uint32());
    case FieldDescriptor::CPPTYPE_BOOL:
      return field.default_value_bool() ? "true" : "false";
    case FieldDescriptor::CPPTYPE_ENUM:
      return field.default_value_enum()->name();
    default:
      return "";
  }
}

std::string allowed_values(const FieldDescriptor& field) {
  const v1::Parameter& parameter = parameter_of(field);
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_ENUM) return enum_names(*field.enum_type());
  if (parameter.has_pattern()) return "`" + parameter.pattern() + "`";
  if (!field.is_repeated()) return allowed_text(parameter);
  std::string text = std::to_string(parameter.min_items());
  return parameter.has_max_items() ? text + " to " + std::to_string(parameter.max_items()) + " items" : text + " or more items";
}

std::string row(const FieldDescriptor& field) {
  const v1::Parameter& parameter = parameter_of(field);
  return "| `" + field.name() + "` | " + type_text(field) + " | " + parameter.unit() + " | " + default_text(field) + " | " +
         allowed_values(field) + " | " + parameter.meaning() + " |\n";
}

std::string choice_text(const OneofDescriptor& choice) {
  std::string arms;
  for (int i = 0; i < choice.field_count(); ++i) arms += (i > 0 ? ", `" : "`") + choice.field(i)->name() + "`";
  return "\nOne " + std::string(choice_of(choice).required() ? "is required" : "at most") + " of " + arms + ": " +
         choice_of(choice).meaning() + ".\n";
}

std::string section(const Descriptor& type) {
  std::string text = "\n## " + type.name() + "\n\n";
  if (type.field_count() == 0) return text + "No fields: write `{}`.\n";
  text += "| field | type | unit | default | allowed | meaning |\n|---|---|---|---|---|---|\n";
  for (int i = 0; i < type.field_count(); ++i) text += row(*type.field(i));
  for (int i = 0; i < type.oneof_decl_count(); ++i) text += choice_text(*type.oneof_decl(i));
  return text;
}

// A message and those that it holds, each once, in the order in which a reader meets them.
void append_blocks(const Descriptor& type, std::vector<const Descriptor*>& blocks) {
  if (std::find(blocks.begin(), blocks.end(), &type) != blocks.end()) return;
  blocks.push_back(&type);
  for (int i = 0; i < type.field_count(); ++i) {
    if (type.field(i)->message_type() != nullptr) append_blocks(*type.field(i)->message_type(), blocks);
  }
}

std::vector<const Descriptor*> all_blocks() {
  std::vector<const Descriptor*> blocks;
  append_blocks(*v1::Case::descriptor(), blocks);
  return blocks;
}

void append_laws(const Descriptor& type, const std::string& path, std::vector<std::string>& laws) {
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    const OneofDescriptor* choice = field.real_containing_oneof();
    const std::string place = child_path(choice == nullptr ? path : child_path(path, choice->name()), field.name());
    if (choice != nullptr) laws.push_back(place);
    if (field.message_type() != nullptr) append_laws(*field.message_type(), place, laws);
  }
}

}  // namespace

std::string parameter_reference() {
  std::string text =
      "# Parameters of a case\n\nA case file is protobuf text format: blocks `name { … }`, values `name: value`, comments after "
      "`#`. "
      "A list is written by\nrepeating its name. JSON with the same names is read too. SI units, angles in radians; x is the "
      "width, y "
      "points up, z is the\ndepth, and the domain's low corner is the origin. Numbers must be finite.\n";
  for (const Descriptor* block : all_blocks()) text += section(*block);
  return text;
}

std::vector<ParameterLine> parameter_lines() {
  std::vector<ParameterLine> lines;
  for (const Descriptor* block : all_blocks()) {
    for (int i = 0; i < block->field_count(); ++i) {
      const FieldDescriptor& field = *block->field(i);
      const std::string type =
          field.message_type() ? (field.is_repeated() ? "list of " : "") + field.message_type()->name() : type_text(field);
      lines.push_back({block->name(), field.name(), type, parameter_of(field).unit(), default_text(field), allowed_values(field),
                       parameter_of(field).meaning()});
    }
  }
  return lines;
}

std::vector<std::string> built_laws() {
  std::vector<std::string> laws;
  append_laws(*v1::Case::descriptor(), "", laws);
  return laws;
}

}  // namespace bedflow
