#include "case_difference.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <array>

#include "parameter_text.h"

namespace bedflow {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::OneofDescriptor;

constexpr const char* none = "none";
constexpr std::array<const char*, 6> model_parts{"domain", "gravity", "gas", "particles", "coupling", "time"};

std::string on_one_line(const Message& message) {
  google::protobuf::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  std::string text;
  printer.PrintToString(message, &text);
  return text.empty() ? "{}" : "{ " + text + "}";
}

bool set(const Message& message, const FieldDescriptor& field) {
  return message.GetReflection()->HasField(message, &field);
}
const Message& part(const Message& message, const FieldDescriptor& field) {
  return message.GetReflection()->GetMessage(message, &field);
}

// The value as a case file has it, with its unit.
std::string value_text(const Message& message, const FieldDescriptor& field) {
  if (!set(message, field) && !field.has_default_value()) return none;
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE)
    return quantity_text(message.GetReflection()->GetDouble(message, &field), parameter_of(field).unit());
  std::string text;
  google::protobuf::TextFormat::PrintFieldValueToString(message, &field, -1, &text);
  return text;
}

class Comparison {
 public:
  void compare(const Message& a, const Message& b, const std::string& path) {
    for (int i = 0; i < a.GetDescriptor()->field_count(); ++i) {
      const FieldDescriptor& field = *a.GetDescriptor()->field(i);
      if (field.containing_oneof() != nullptr) continue;
      const std::string here = child_path(path, field.name());
      if (field.is_repeated()) {
        compare_lists(a, b, field, here);
      } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
        compare_parts(a, b, field, here);
      } else {
        note(here, value_text(a, field), value_text(b, field));
      }
    }
    for (int i = 0; i < a.GetDescriptor()->oneof_decl_count(); ++i)
      compare_choices(a, b, *a.GetDescriptor()->oneof_decl(i), path);
  }

  void compare_parts(const Message& a, const Message& b, const FieldDescriptor& field, const std::string& path) {
    if (set(a, field) == set(b, field)) return compare(part(a, field), part(b, field), path);
    const auto text = [&](const Message& message) { return set(message, field) ? on_one_line(part(message, field)) : none; };
    found.push_back({path, text(a), text(b)});
  }

  std::vector<CaseDifference> found;

 private:
  void note(const std::string& path, const std::string& a, const std::string& b) {
    if (a != b) found.push_back({path, a, b});
  }

  // Of two arms each is told with its numbers; of one arm, where they differ.
  void compare_choices(const Message& a, const Message& b, const OneofDescriptor& choice, const std::string& path) {
    const auto* arm = a.GetReflection()->GetOneofFieldDescriptor(a, &choice);
    if (arm != nullptr && arm == b.GetReflection()->GetOneofFieldDescriptor(b, &choice))
      return compare(part(a, *arm), part(b, *arm), child_path(path, arm->name()));
    const auto text = [&](const Message& message) {
      const auto* chosen = message.GetReflection()->GetOneofFieldDescriptor(message, &choice);
      return chosen == nullptr ? std::string(none) : chosen->name() + " " + on_one_line(part(message, *chosen));
    };
    note(child_path(path, choice.name()), text(a), text(b));
  }

  void compare_lists(const Message& a, const Message& b, const FieldDescriptor& field, const std::string& path) {
    const int size = a.GetReflection()->FieldSize(a, &field), other = b.GetReflection()->FieldSize(b, &field);
    if (size != other) return note(path, std::to_string(size) + " items", std::to_string(other) + " items");
    for (int i = 0; i < size; ++i) {
      const std::string here = item_path(path, i);
      if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
        compare(a.GetReflection()->GetRepeatedMessage(a, &field, i), b.GetReflection()->GetRepeatedMessage(b, &field, i), here);
      } else {
        std::string in_a, in_b;
        google::protobuf::TextFormat::PrintFieldValueToString(a, &field, i, &in_a);
        google::protobuf::TextFormat::PrintFieldValueToString(b, &field, i, &in_b);
        note(here, in_a, in_b);
      }
    }
  }
};

}  // namespace

std::vector<CaseDifference> differences(const v1::Case& first, const v1::Case& second) {
  Comparison comparison;
  for (const char* name : model_parts) {
    const FieldDescriptor& field = *v1::Case::descriptor()->FindFieldByName(name);
    comparison.compare_parts(first, second, field, name);
  }
  return comparison.found;
}

}  // namespace bedflow
