// Data on stdout: a table for people, or JSON, JSON lines and CSV for programs.
#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

namespace bedflow::client {

enum class Format { table, json, jsonl, csv };

// Nothing, text, a number, or a switch. Numbers keep all digits in JSON and CSV.
using Cell = std::variant<std::monostate, std::string, double, std::uint64_t, bool>;

class Table {
 public:
  explicit Table(std::vector<std::string> columns) : columns_(std::move(columns)) {}
  void add(std::vector<Cell> row) { rows_.push_back(std::move(row)); }  // as many cells as columns
  bool empty() const { return rows_.empty(); }

  // json: an array of objects; jsonl: an object a line; csv: RFC 4180 with a header.
  std::string text(Format format) const;
  std::string markdown() const;

 private:
  std::string for_people() const;
  std::string csv() const;
  std::string json_row(const std::vector<Cell>& row) const;

  std::vector<std::string> columns_;
  std::vector<std::vector<Cell>> rows_;
};

std::string json_text(const google::protobuf::Message& message, bool indent);  // the schema's field names
std::string json_quoted(const std::string& text);

// One object of the API: JSON is the message itself, a table or CSV its rows.
void print_message(const google::protobuf::Message& message, const Table& table, Format format);
// Several: a JSON array, or a message a line.
void print_messages(const std::vector<const google::protobuf::Message*>& messages, const Table& table, Format format);

void print_data(const std::string& text);  // on stdout; throws Failure when it cannot be written

}  // namespace bedflow::client
