#include "case_source.h"

#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <optional>

#include "cases/ready_cases.h"
#include "failure.h"
#include "fidelity.h"

namespace bedflow::client {

namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

std::string field_names(const Descriptor& descriptor) {
  std::string names;
  for (int i = 0; i < descriptor.field_count(); ++i) names += (i ? ", " : "") + descriptor.field(i)->name();
  return names;
}

struct PathPart {
  std::string name;
  std::optional<int> index;
};

std::optional<PathPart> path_part(const std::string& text) {
  PathPart part;
  const auto bracket = text.find('[');
  part.name = text.substr(0, bracket);
  if (bracket == text.npos) return part;
  int index = -1;
  const auto* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + bracket + 1, end, index);
  if (error != std::errc() || index < 0 || rest + 1 != end || *rest != ']') return std::nullopt;
  part.index = index;
  return part;
}

[[noreturn]] void refuse(const std::string& assignment, const std::string& why) {
  throw Failure(Exit::usage, "--set " + assignment + ": " + why, "the names, units and bounds: bedflow reference");
}

const FieldDescriptor& field_of(const Message& message, const std::string& name, const std::string& assignment) {
  const auto* field = message.GetDescriptor()->FindFieldByName(name);
  if (field == nullptr)
    refuse(assignment, "there is no field \"" + name + "\" here; there are " + field_names(*message.GetDescriptor()));
  return *field;
}

Message& step_into(Message& message, const PathPart& part, const std::string& assignment) {
  const auto& field = field_of(message, part.name, assignment);
  if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) refuse(assignment, "\"" + part.name + "\" has no fields of its own");
  const auto& reflection = *message.GetReflection();
  if (!field.is_repeated()) {
    if (part.index) refuse(assignment, "\"" + part.name + "\" is not a list");
    return *reflection.MutableMessage(&message, &field);
  }
  const int size = reflection.FieldSize(message, &field);
  if (!part.index || *part.index >= size) {
    refuse(assignment, "\"" + part.name + "\" is a list of " + std::to_string(size) + "; name one as " + part.name + "[0]");
  }
  return *reflection.MutableRepeatedMessage(&message, &field, *part.index);
}

class Complaint : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int, int, const std::string& message) override { text += (text.empty() ? "" : "; ") + message; }
  void AddWarning(int, int, const std::string&) override {}
  std::string text;
};

// The text parser does the rest, so that a value means here what it means in a case file.
void assign(Message& message, const FieldDescriptor& field, const std::string& value, const std::string& assignment) {
  std::string text = field.name();
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    text += " { " + value + " }";
  } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING && !value.starts_with('"')) {
    std::string escaped;
    for (const char c : value) escaped += c == '"' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    text += ": \"" + escaped + "\"";
  } else {
    text += ": " + value;
  }
  if (const auto* choice = field.containing_oneof()) message.GetReflection()->ClearOneof(&message, choice);
  Complaint complaint;
  google::protobuf::TextFormat::Parser parser;
  parser.RecordErrorsTo(&complaint);
  if (!parser.MergeFromString(text, &message)) refuse(assignment, complaint.text);
}

CaseRead read_any(const std::string& where) {
  if (where == "-") {
    return read_case(std::string(std::istreambuf_iterator<char>(std::cin), {}));
  }
  if (!std::filesystem::exists(where)) {
    const auto at = where.find('@');
    const std::string name = where.substr(0, at), preset = at == where.npos ? "" : where.substr(at + 1);
    const auto has = [](const auto& list, const std::string& wanted) {
      return std::any_of(list.begin(), list.end(), [&](const auto& one) { return one.name == wanted; });
    };
    if (has(ready_cases(), name) && (at == where.npos || has(ready_presets(), preset))) {
      auto value = ready_case(name, preset);
      auto faults = check_case(value);
      return {std::move(value), std::move(faults)};
    }
    throw Failure(Exit::usage, "there is no file \"" + where + "\" and no ready case of that name",
                  "the ready cases are " + ready_case_names() + "; write one with: bedflow init NAME > case.txtpb");
  }
  if (std::filesystem::is_directory(where)) throw Failure(Exit::usage, "\"" + where + "\" is a folder, not a case");
  return read_case_file(where);
}

}  // namespace

void set_value(v1::Case& value, const std::string& assignment) {
  const auto equals = assignment.find('=');
  const std::string path = assignment.substr(0, equals);
  if (path == "fidelity" && equals != assignment.npos) {  // who names it here means it, whatever the case says
    std::string name = assignment.substr(equals + 1);
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::toupper(c); });
    leave_open(value);
    assign(value, field_of(value, path, assignment), name, assignment);
    return complete(value);
  }
  Message* message = &value;
  std::size_t start = 0;
  while (true) {
    const auto dot = path.find('.', start);
    const auto part = path_part(path.substr(start, dot == path.npos ? dot : dot - start));
    if (!part) refuse(assignment, "not of the form path=value, as in particles.random.count=100 or monitors[2].interval=0");
    if (dot == path.npos) {
      const auto& field = field_of(*message, part->name, assignment);
      const bool is_message = field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
      if (equals == assignment.npos && !is_message) refuse(assignment, "a value is missing: " + path + "=VALUE");
      if (part->index) refuse(assignment, "name a field of the list's item, as in " + path + ".name=VALUE");
      return assign(*message, field, equals == assignment.npos ? "" : assignment.substr(equals + 1), assignment);
    }
    message = &step_into(*message, *part, assignment);
    start = dot + 1;
  }
}

v1::Case load_case(const std::string& where, const std::vector<std::string>& assignments) {
  auto [value, faults] = read_any(where);
  const bool readable =
      std::none_of(faults.begin(), faults.end(), [](const auto& fault) { return fault.path.starts_with("line "); });
  if (!assignments.empty() && readable) {
    for (const auto& assignment : assignments) set_value(value, assignment);
    faults = check_case(value);
  }
  if (!faults.empty()) {
    const auto count = faults.size();
    throw Failure(Exit::usage, "the case " + where + " has " + std::to_string(count) + (count == 1 ? " fault:" : " faults:"),
                  "the names, units and bounds: bedflow reference", std::move(faults));
  }
  return value;
}

std::string ready_case_names() {
  std::string names;
  for (const auto& one : ready_cases()) names += (names.empty() ? "" : ", ") + std::string(one.name);
  return names;
}

}  // namespace bedflow::client
