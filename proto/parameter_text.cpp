#include "parameter_text.h"

#include <array>
#include <charconv>

namespace bedflow {

const v1::Parameter& parameter_of(const google::protobuf::FieldDescriptor& field) {
  return field.options().GetExtension(v1::parameter);
}

const v1::Choice& choice_of(const google::protobuf::OneofDescriptor& choice) {
  return choice.options().GetExtension(v1::choice);
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string quantity_text(double value, const std::string& unit) {
  return number_text(value) + (unit.empty() || unit == "1" ? "" : " " + unit);
}

std::string allowed_text(const v1::Parameter& parameter) {
  std::string text;
  if (parameter.has_min()) text += (parameter.min_excluded() ? "above " : "at least ") + number_text(parameter.min());
  if (parameter.has_min() && parameter.has_max()) text += " and ";
  if (parameter.has_max()) text += (parameter.max_excluded() ? "below " : "at most ") + number_text(parameter.max());
  if (!text.empty() && !parameter.unit().empty() && parameter.unit() != "1") text += " " + parameter.unit();
  return text;
}

std::string child_path(const std::string& path, const std::string& name) {
  return path.empty() ? name : path + "." + name;
}

std::string item_path(const std::string& path, int index) {
  return path + "[" + std::to_string(index) + "]";
}

}  // namespace bedflow
