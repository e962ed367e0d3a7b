#include "table.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "failure.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

template <class... Cases>
struct Visitor : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Visitor(Cases...) -> Visitor<Cases...>;

std::string all_digits(double value) {
  std::array<char, 40> text{};
  for (const int digits : {15, 16, 17}) {
    std::snprintf(text.data(), text.size(), "%.*g", digits, value);
    if (std::strtod(text.data(), nullptr) == value) break;
  }
  return text.data();
}

bool is_number(const Cell& cell) {
  return std::holds_alternative<double>(cell) || std::holds_alternative<std::uint64_t>(cell);
}

std::string plain(const Cell& cell) {
  return std::visit(Visitor{[](std::monostate) { return std::string("-"); }, [](const std::string& text) { return text; },
                            [](double value) { return std::isfinite(value) ? number_text(value) : std::string("-"); },
                            [](std::uint64_t value) { return std::to_string(value); },
                            [](bool value) { return std::string(value ? "yes" : "no"); }},
                    cell);
}

std::string json_cell(const Cell& cell) {
  return std::visit(
      Visitor{[](std::monostate) { return std::string("null"); }, [](const std::string& text) { return json_quoted(text); },
              [](double value) { return std::isfinite(value) ? all_digits(value) : std::string("null"); },
              [](std::uint64_t value) { return std::to_string(value); },
              [](bool value) { return std::string(value ? "true" : "false"); }},
      cell);
}

std::string csv_cell(const Cell& cell) {
  if (std::holds_alternative<std::monostate>(cell)) return "";
  if (const auto* text = std::get_if<std::string>(&cell)) {
    if (text->find_first_of(",\"\r\n") == text->npos) return *text;
    std::string quoted = "\"";
    for (const char c : *text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
  }
  const auto json = json_cell(cell);
  return json == "null" ? "" : json;
}

}  // namespace

std::string json_quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += std::string("\\") + c;
    } else if (c == '\n') {
      quoted += "\\n";
    } else if (static_cast<unsigned char>(c) < 0x20) {
      std::array<char, 8> code{};
      std::snprintf(code.data(), code.size(), "\\u%04x", c);
      quoted += code.data();
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

std::string Table::json_row(const std::vector<Cell>& row) const {
  std::string text = "{";
  for (std::size_t i = 0; i < columns_.size(); ++i) text += (i ? ", " : "") + json_quoted(columns_[i]) + ": " + json_cell(row[i]);
  return text + "}";
}

std::string Table::csv() const {
  std::string text;
  const auto add_line = [&](const auto& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i > 0) text += ',';
      text += csv_cell(cells[i]);
    }
    text += '\n';
  };
  add_line(columns_);
  for (const auto& row : rows_) add_line(row);
  return text;
}

// Numbers to the right, text to the left, two blanks between the columns.
std::string Table::for_people() const {
  const Terminal terminal(stdout);
  std::vector<std::size_t> width(columns_.size());
  std::vector<char> right(columns_.size(), 0);
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    width[i] = display_width(columns_[i]);
    for (const auto& row : rows_) {
      width[i] = std::max(width[i], display_width(plain(row[i])));
      if (is_number(row[i])) right[i] = 1;
    }
  }
  const auto line = [&](const auto& cell_text) {
    std::string text;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const std::string cell = cell_text(i);
      const std::string pad(width[i] - display_width(cell), ' ');
      text += (i ? "  " : "") + (right[i] ? pad + cell : cell + pad);
    }
    return text.erase(text.find_last_not_of(' ') + 1);
  };
  std::string text = terminal.paint(Colour::bold, line([&](std::size_t i) { return columns_[i]; })) + "\n";
  for (const auto& row : rows_) text += line([&](std::size_t i) { return plain(row[i]); }) + "\n";
  return text;
}

std::string Table::markdown() const {
  std::string text = "|", rule = "|";
  for (const auto& column : columns_) {
    text += " " + column + " |";
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  for (const auto& row : rows_) {
    text += "|";
    for (const auto& cell : row) text += " " + plain(cell) + " |";
    text += "\n";
  }
  return text;
}

std::string Table::text(Format format) const {
  if (format == Format::table) return for_people();
  if (format == Format::csv) return csv();
  std::string text;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    text += format == Format::jsonl ? json_row(rows_[i]) + "\n" : std::string(i ? ",\n  " : "\n  ") + json_row(rows_[i]);
  }
  return format == Format::jsonl ? text : "[" + text + (rows_.empty() ? "]\n" : "\n]\n");
}

std::string json_text(const google::protobuf::Message& message, bool indent) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = indent;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw Failure(Exit::other, "the answer cannot be written as JSON: " + status.ToString());
  return text.ends_with('\n') ? text : text + "\n";
}

void print_message(const google::protobuf::Message& message, const Table& table, Format format) {
  if (format == Format::table || format == Format::csv) return print_data(table.text(format));
  print_data(json_text(message, format == Format::json));
}

void print_messages(const std::vector<const google::protobuf::Message*>& messages, const Table& table, Format format) {
  if (format == Format::table || format == Format::csv) return print_data(table.text(format));
  std::string text = format == Format::json ? "[" : "";
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const auto one = json_text(*messages[i], false);
    text += format == Format::jsonl ? one : (i ? ",\n" : "\n") + one.substr(0, one.size() - 1);
  }
  print_data(format == Format::jsonl ? text : text + "\n]\n");
}

void print_data(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw Failure(Exit::other, "the output cannot be written");
  }
}

}  // namespace bedflow::client
