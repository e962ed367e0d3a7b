#include "case_parser.h"

#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <map>

#include "parameter_text.h"

namespace bedflow {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

constexpr int deepest_nesting = 50;        // blocks within blocks; the schema's own depth is below ten
constexpr std::size_t longest_name = 64;   // of a field that does not exist, for the search of similar ones
constexpr std::size_t longest_text = 300;  // of a parser's own message

// Deep nesting exhausts the parsers' stack, so it is refused first. `line_ends_string`: as in the text format.
bool is_too_deep(const std::string& text, bool line_ends_string) {
  int depth = 0;
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote != 0) {
      if (c == '\\') ++i;
      if (c == quote || (line_ends_string && c == '\n')) quote = 0;
    } else if (c == '"' || (c == '\'' && line_ends_string)) {
      quote = c;
    } else if (c == '#' && line_ends_string) {
      i = std::min(text.find('\n', i), text.size());
    } else if (c == '{' || c == '[' || c == '<') {
      if (++depth > deepest_nesting) return true;
    } else if (c == '}' || c == ']' || c == '>') {
      depth = std::max(depth - 1, 0);
    }
  }
  return false;
}

CaseFault too_deep() {
  return {"text", "has more than " + std::to_string(deepest_nesting) + " blocks within blocks: no case needs that"};
}

// Insertions, deletions and replacements between two names (Levenshtein).
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

// What to write instead of a field that `type` does not have.
std::string advice(const Descriptor& type, const std::string& name) {
  std::vector<std::string> all, near, elsewhere;
  for (int i = 0; i < type.field_count(); ++i) {
    const std::string& known = type.field(i)->name();
    all.push_back(known);
    if (name.size() <= longest_name && distance(name, known) <= std::max<std::size_t>(1, known.size() / 3)) near.push_back(known);
  }
  const auto look = [&](const google::protobuf::FileDescriptor& file) {
    for (int i = 0; i < file.message_type_count(); ++i) {
      if (file.message_type(i)->FindFieldByName(name) != nullptr) elsewhere.push_back(file.message_type(i)->name());
    }
  };
  const auto& schema = *v1::Case::descriptor()->file();
  look(schema);
  for (int i = 0; i < schema.dependency_count(); ++i) look(*schema.dependency(i));
  std::string text;
  if (!near.empty()) {
    text = "; did you mean " + joined(near) + "?";
  } else if (!elsewhere.empty()) {
    text = "; it belongs in " + joined(elsewhere) + ": is a } missing or one too many?";
  } else if (all.empty()) {
    text = "; " + type.name() + " has no fields: write {}";
  } else {
    text = "; " + type.name() + " has " + joined(all);
  }
  return text + " ('bedflow reference' lists all)";
}

std::string shortened(const std::string& text) {
  return text.size() <= longest_text ? text : text.substr(0, longest_text) + "…";
}

std::string unknown_field(const Descriptor& type, const std::string& name) {
  return "unknown field " + shortened(name) + advice(type, name);
}

std::string two_arms(const std::string& first, const std::string& second, const std::string& choice) {
  return "both " + first + " and " + second + " are set, but only one " + choice + " can be: keep one of them";
}

// The texts between the double quotes of a parser's message.
std::vector<std::string> quoted(const std::string& message) {
  std::vector<std::string> parts;
  std::size_t begin = message.find('"');
  while (begin != std::string::npos) {
    const std::size_t end = message.find('"', begin + 1);
    if (end == std::string::npos) break;
    parts.push_back(message.substr(begin + 1, end - begin - 1));
    begin = message.find('"', end + 1);
  }
  return parts;
}

// The text parser's message in our words; where its own are clear they stay.
std::string in_our_words(const std::string& message) {
  const auto parts = quoted(message);
  const auto starts = [&](const char* text) { return message.starts_with(text); };
  if (starts("Message type") && parts.size() >= 2) {
    const Descriptor* type = v1::Case::descriptor()->file()->pool()->FindMessageTypeByName(parts[0]);
    if (type != nullptr) return unknown_field(*type, parts[1]);
  }
  if (starts("Non-repeated field") && !parts.empty()) return parts[0] + " is set twice: keep one";
  if (starts("Field") && parts.size() >= 3) return two_arms(parts[1], parts[0], parts[2]);
  if (message == "Expected identifier, got: ") return "the text ends inside a block: a } is missing";
  if (starts("Expected \"{\"")) return "a block is expected here: write name { … }";
  if (starts("Expected \":\"")) return "a value is expected here: write name: value";
  if (message == "Expected integer, got: -") return "a whole number that is not negative is expected here";
  if (starts("Ignoring extension")) return "unknown field in brackets: a case has no extensions; remove it";
  return shortened(message);
}

class FaultCollector : public google::protobuf::io::ErrorCollector {
 public:
  explicit FaultCollector(std::vector<CaseFault>& faults) : faults_(faults) {}
  void AddError(int line, int column, const std::string& message) override {
    faults_.push_back({"line " + std::to_string(line + 1) + ", column " + std::to_string(column + 1), in_our_words(message)});
  }
  void AddWarning(int line, int column, const std::string& message) override { AddError(line, column, message); }

 private:
  std::vector<CaseFault>& faults_;
};

const FieldDescriptor* field_of_json_name(const Descriptor& type, const std::string& name) {
  for (int i = 0; i < type.field_count(); ++i) {
    if (type.field(i)->name() == name || type.field(i)->json_name() == name) return type.field(i);
  }
  return nullptr;
}

// Finds what the JSON parser would name one at a time: fields that do not exist and two arms of a choice.
void check_json_names(const google::protobuf::Struct& block, const Descriptor& type, const std::string& path,
                      std::vector<CaseFault>& faults) {
  const std::map<std::string, google::protobuf::Value> members(block.fields().begin(), block.fields().end());  // in order
  std::map<std::string, std::string> chosen;  // arm of each choice
  for (const auto& [name, value] : members) {
    const FieldDescriptor* field = field_of_json_name(type, name);
    const std::string place = child_path(path, shortened(name));
    if (field == nullptr) {
      faults.push_back({place, unknown_field(type, name)});
      continue;
    }
    if (const auto* choice = field->real_containing_oneof(); choice != nullptr && !value.has_null_value()) {
      const auto [arm, is_first] = chosen.emplace(choice->name(), name);
      if (!is_first) faults.push_back({place, two_arms(arm->second, name, choice->name())});
    }
    if (field->message_type() == nullptr) continue;
    if (value.has_struct_value()) check_json_names(value.struct_value(), *field->message_type(), place, faults);
    for (int i = 0; i < value.list_value().values_size(); ++i) {
      const auto& item = value.list_value().values(i);
      if (item.has_struct_value()) check_json_names(item.struct_value(), *field->message_type(), item_path(place, i), faults);
    }
  }
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return shortened(text);
}

// "(gas.density): invalid value …" -> path and text.
CaseFault json_fault(const std::string& message) {
  const std::size_t end = message.starts_with("(") ? message.find("): ") : std::string::npos;
  if (end == std::string::npos) return {"JSON", one_line(message)};
  return {message.substr(1, end - 1), one_line(message.substr(end + 3))};
}

}  // namespace

CaseParse parse_case_text(const std::string& text) {
  CaseParse result;
  if (is_too_deep(text, true)) {
    result.faults.push_back(too_deep());
    return result;
  }
  FaultCollector collector(result.faults);
  google::protobuf::TextFormat::Parser parser;
  parser.RecordErrorsTo(&collector);
  parser.AllowUnknownField(true);  // told as a warning, a fault here: so the parser goes on and finds the next
  result.read_to_end = parser.ParseFromString(text, &result.value);
  return result;
}

CaseParse parse_case_json(const std::string& text) {
  namespace json = google::protobuf::util;
  CaseParse result;
  if (is_too_deep(text, false)) {
    result.faults.push_back(too_deep());
    return result;
  }
  google::protobuf::Struct members;
  if (const auto status = json::JsonStringToMessage(text, &members); !status.ok()) {
    result.faults.push_back({"JSON", "is not valid: " + one_line(status.message().as_string())});
    return result;
  }
  check_json_names(members, *v1::Case::descriptor(), "", result.faults);
  json::JsonParseOptions options;
  options.ignore_unknown_fields = true;  // they are faults already
  const auto status = json::JsonStringToMessage(text, &result.value, options);
  result.read_to_end = status.ok();
  if (!status.ok() && result.faults.empty()) result.faults.push_back(json_fault(status.message().as_string()));
  return result;
}

}  // namespace bedflow
