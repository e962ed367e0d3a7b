#include "case_walker.h"

#include <cmath>
#include <regex>

#include "parameter_text.h"

namespace bedflow {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::OneofDescriptor;
using google::protobuf::Reflection;

constexpr std::size_t longest_quote = 80;  // of a user's text within a fault

// Whether the bytes are UTF-8 as RFC 3629 has it, without control characters other than line ends and tabs.
bool is_plain_text(const std::string& text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    if (lead < 0x80) {
      if (lead < 0x20 && lead != '\n' && lead != '\t' && lead != '\r') return false;
      ++i;
      continue;
    }
    const int more =
        lead >= 0xC2 && lead <= 0xDF ? 1 : (lead >= 0xE0 && lead <= 0xEF ? 2 : (lead >= 0xF0 && lead <= 0xF4 ? 3 : 0));
    if (more == 0 || i + more >= text.size()) return false;
    std::uint32_t code = lead & (0x3FU >> more);
    for (int k = 1; k <= more; ++k) {
      const auto byte = static_cast<unsigned char>(text[i + k]);
      if ((byte & 0xC0U) != 0x80U) return false;
      code = code << 6U | (byte & 0x3FU);
    }
    const bool overlong = (more == 2 && code < 0x800) || (more == 3 && code < 0x10000);
    if (overlong || (code >= 0xD800 && code <= 0xDFFF) || code > 0x10FFFF) return false;
    i += more + 1;
  }
  return true;
}

class Walker {
 public:
  // `bounds` are those of the Vector field that the message is the value of.
  void check_message(const Message& message, const std::string& path, const v1::Parameter* bounds = nullptr) {
    const Descriptor& type = *message.GetDescriptor();
    const auto& unknown = message.GetReflection()->GetUnknownFields(message);
    for (int i = 0; i < unknown.field_count(); ++i) {
      report(path, "has a field of number " + std::to_string(unknown.field(i).number()) +
                       " that this version does not know: the case comes from a newer version, or is damaged");
    }
    for (int i = 0; i < type.field_count(); ++i) {
      check_field(message, *type.field(i), child_path(path, type.field(i)->name()), bounds);
    }
    for (int i = 0; i < type.oneof_decl_count(); ++i) check_choice(message, *type.oneof_decl(i), path);
  }

  std::vector<CaseFault> faults;

 private:
  void report(const std::string& path, const std::string& text) { faults.push_back({path.empty() ? "case" : path, text}); }

  void check_field(const Message& message, const FieldDescriptor& field, const std::string& path, const v1::Parameter* bounds) {
    const v1::Parameter& parameter = parameter_of(field);
    const Reflection& access = *message.GetReflection();
    if (field.is_repeated()) {
      check_items(message, field, path);
    } else if (!access.HasField(message, &field)) {
      if (parameter.required()) report_missing(path, parameter);
    } else {
      check_value(message, field, path, bounds);
    }
  }

  void report_missing(const std::string& path, const v1::Parameter& parameter) {
    std::string text = "is missing: " + parameter.meaning();
    const std::string allowed = allowed_text(parameter);
    if (!allowed.empty()) {
      text += "; set it: allowed is " + allowed;
    } else if (parameter.has_unit() && parameter.unit() != "1") {
      text += "; set it, in " + parameter.unit();
    } else {
      text += "; set it";
    }
    report(path, text);
  }

  void check_items(const Message& message, const FieldDescriptor& field, const std::string& path) {
    const v1::Parameter& parameter = parameter_of(field);
    const int size = message.GetReflection()->FieldSize(message, &field);
    if (static_cast<std::uint32_t>(size) < parameter.min_items()) {
      report(path, "has " + std::to_string(size) + " items: at least " + std::to_string(parameter.min_items()) + " are needed (" +
                       parameter.meaning() + ")");
    }
    if (parameter.has_max_items() && static_cast<std::uint32_t>(size) > parameter.max_items()) {
      report(path, "has " + std::to_string(size) + " items: at most " + std::to_string(parameter.max_items()) + " are allowed");
    }
    // The schema repeats messages only; a test holds it to that.
    for (int i = 0; i < size; ++i) {
      check_message(message.GetReflection()->GetRepeatedMessage(message, &field, i), item_path(path, i));
    }
  }

  void check_value(const Message& message, const FieldDescriptor& field, const std::string& path, const v1::Parameter* bounds) {
    const v1::Parameter& own = parameter_of(field);
    const v1::Parameter& parameter = bounds != nullptr ? *bounds : own;
    const Reflection& access = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        check_number(access.GetDouble(message, &field), path, parameter);
        break;
      case FieldDescriptor::CPPTYPE_UINT32:
        check_number(access.GetUInt32(message, &field), path, parameter);
        break;
      case FieldDescriptor::CPPTYPE_UINT64:
        check_number(static_cast<double>(access.GetUInt64(message, &field)), path, parameter);
        break;
      case FieldDescriptor::CPPTYPE_STRING:
        check_string(access.GetString(message, &field), path, parameter);
        break;
      case FieldDescriptor::CPPTYPE_MESSAGE:
        check_message(access.GetMessage(message, &field), path,
                      field.message_type() == v1::Vector::descriptor() ? &own : nullptr);
        break;
      default:  // switches and names of an enum: the parser refuses others
        break;
    }
  }

  void check_number(double value, const std::string& path, const v1::Parameter& parameter) {
    const std::string allowed = allowed_text(parameter);
    if (!std::isfinite(value)) {
      report(path, "is " + number_text(value) + ": a finite number is needed" + (allowed.empty() ? "" : ", " + allowed));
      return;
    }
    const bool low = parameter.has_min() && (parameter.min_excluded() ? value <= parameter.min() : value < parameter.min());
    const bool high = parameter.has_max() && (parameter.max_excluded() ? value >= parameter.max() : value > parameter.max());
    if (low || high) report(path, "is " + quantity_text(value, parameter.unit()) + ": allowed is " + allowed);
  }

  void check_string(const std::string& value, const std::string& path, const v1::Parameter& parameter) {
    if (!is_plain_text(value)) {
      report(path, "has bytes that are not text in UTF-8, or control characters: remove them");
    } else if (parameter.has_pattern() && !std::regex_match(value, std::regex(parameter.pattern()))) {
      const std::string quote = value.size() > longest_quote ? value.substr(0, longest_quote) + "…" : value;
      report(path, "is \"" + quote + "\": it must match " + parameter.pattern() + " (" + parameter.meaning() + ")");
    } else if (parameter.required() && value.empty()) {
      report_missing(path, parameter);
    }
  }

  void check_choice(const Message& message, const OneofDescriptor& choice, const std::string& path) {
    if (!choice_of(choice).required() || message.GetReflection()->HasOneof(message, &choice)) return;
    std::string arms;
    for (int i = 0; i < choice.field_count(); ++i) arms += (i > 0 ? ", " : "") + choice.field(i)->name();
    report(child_path(path, choice.name()), "is missing: " + choice_of(choice).meaning() +
                                                (choice.field_count() > 1 ? "; set one of " : "; set ") + arms + " in " +
                                                (path.empty() ? "the case" : path));
  }
};

}  // namespace

std::vector<CaseFault> walk_case(const v1::Case& value) {
  Walker walker;
  walker.check_message(value, "");
  return std::move(walker.faults);
}

}  // namespace bedflow
