#include "field.h"

#include <array>
#include <cmath>
#include <cstring>

#include "child.h"
#include "connection.h"
#include "results.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

void take(Field& field, v1::FieldAnswer&& part) {
  if (part.has_header()) {
    field.header = std::move(*part.mutable_header());
    std::size_t values = 1;
    for (const auto extent : field.header.shape()) values *= extent;
    field.columns.assign(static_cast<std::size_t>(field.header.columns_size()), std::vector<double>(values, NAN));
    return;
  }
  const auto& values = part.values();
  if (values.column() >= field.columns.size()) return;
  auto& column = field.columns[values.column()];
  if (values.offset() > column.size() || static_cast<std::size_t>(values.value_size()) > column.size() - values.offset()) return;
  std::copy(values.value().begin(), values.value().end(), column.begin() + static_cast<std::ptrdiff_t>(values.offset()));
}

Field ask_server(const FieldSource& source, const v1::FieldQuery& query) {
  v1::QueryFieldRequest request;
  request.mutable_name()->set_job(source.job);
  if (source.step) request.mutable_name()->set_step(*source.step);
  *request.mutable_query() = query;
  if (source.fresh) request.set_fresh(true);
  const Connection connection(source.server);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(5));
  const auto reader = connection.stub().QueryField(&context, request);
  Field field;
  v1::FieldAnswer part;
  while (reader->Read(&part)) take(field, std::move(part));
  if (const auto status = reader->Finish(); !status.ok()) throw connection.failure_of(status);
  return field;
}

// Each part after its length (4 bytes, little-endian).
Field field_of(const std::string& framed) {
  Field field;
  for (std::size_t place = 0; place + 4 <= framed.size();) {
    std::uint32_t length = 0;
    std::memcpy(&length, framed.data() + place, 4);
    v1::FieldAnswer part;
    if (length > framed.size() - place - 4 || !part.ParseFromArray(framed.data() + place + 4, static_cast<int>(length)))
      throw Failure(Exit::other, "bedflow-reader's answer cannot be understood; is it of the same version?");
    take(field, std::move(part));
    place += 4 + length;
  }
  return field;
}

// The server's reader, on a file of ours.
Field ask_file(const std::filesystem::path& file, const v1::FieldQuery& query) {
  constexpr int wrong_question = 2;
  const auto result = run_child(
      {beside_own_executable("bedflow-reader").string(), "--seconds", "3600", "field", file.string(), query.ShortDebugString()});
  if (result.exit_code == 0) return field_of(result.out);
  const auto said = result.error.substr(0, result.error.find_last_not_of('\n') + 1);
  const auto code = result.exit_code == wrong_question           ? Exit::usage
                    : result.exit_code == v1::CHECKPOINT_CORRUPT ? Exit::corrupt
                    : result.exit_code == v1::OUT_OF_MEMORY      ? Exit::limit
                                                                 : Exit::other;
  throw Failure(code, said.empty() ? "bedflow-reader ended with exit code " + std::to_string(result.exit_code) : said,
                code == Exit::usage ? "bedflow field --help" : "");
}

std::string axis_column(const v1::FieldPlaces& axis) {
  return axis.name() + "_" + axis.unit();
}

Table long_form(const Field& field) {
  const auto& header = field.header;
  std::vector<std::string> names;
  for (const auto& axis : header.axes()) names.push_back(axis_column(axis));
  for (const auto& column : header.columns()) names.push_back(column.name());
  Table table(names);
  const std::size_t rows = field.columns.empty() ? 0 : field.columns[0].size();
  for (std::size_t row = 0; row < rows; ++row) {
    std::vector<Cell> cells;
    std::size_t stride = rows;
    for (const auto& axis : header.axes()) {
      stride /= static_cast<std::size_t>(std::max(axis.place_size(), 1));
      cells.emplace_back(axis.place(static_cast<int>(row / std::max<std::size_t>(stride, 1)) % axis.place_size()));
    }
    for (const auto& column : field.columns) cells.push_back(std::isnan(column[row]) ? Cell() : Cell(column[row]));
    table.add(std::move(cells));
  }
  return table;
}

Table reduced_table(const v1::FieldHeader& header) {
  Table table({"quantity", "unit", "minimum", "maximum", "mean", "deviation", "integral", "integral_unit", "weight"});
  const auto cell = [](bool has, double value) { return has ? Cell(value) : Cell(); };
  for (const auto& one : header.reduced()) {
    table.add({one.quantity().name(), one.quantity().unit(), cell(one.has_minimum(), one.minimum()),
               cell(one.has_maximum(), one.maximum()), cell(one.has_mean(), one.mean()),
               cell(one.has_deviation(), one.deviation()), one.integral(), one.integral_unit(), one.weight()});
  }
  return table;
}

Table histogram_table(const v1::FieldHeader& header) {
  Table table({"quantity", "unit", "low", "high", "share"});
  for (const auto& one : header.reduced()) {
    const double width = (one.histogram_high() - one.histogram_low()) / std::max(one.histogram_size(), 1);
    for (int bin = 0; bin < one.histogram_size(); ++bin) {
      table.add({one.quantity().name(), one.quantity().unit(), one.histogram_low() + bin * width,
                 one.histogram_low() + (bin + 1) * width, one.histogram(bin)});
    }
  }
  return table;
}

std::string json_number(double value) {
  if (!std::isfinite(value)) return "null";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.17g", value);
  return text.data();
}

// Nested lists of the shape, from `place` on.
std::string json_array(const std::vector<double>& values, const v1::FieldHeader& header, int axis, std::size_t& place) {
  if (axis == header.shape_size()) return json_number(values[place++]);
  std::string text = "[";
  for (std::uint64_t i = 0; i < header.shape(axis); ++i) text += (i ? "," : "") + json_array(values, header, axis + 1, place);
  return text + "]";
}

// The header, and the values of each column by its name.
std::string json_of(const Field& field) {
  std::string text = json_text(field.header, false);
  while (!text.empty() && (text.back() == '\n' || text.back() == '}')) text.pop_back();
  text += std::string(text.back() == '{' ? "" : ",") + "\"values\":{";
  for (std::size_t c = 0; c < field.columns.size(); ++c) {
    std::size_t place = 0;
    text += (c ? "," : "") + json_quoted(field.header.columns(static_cast<int>(c)).name()) + ":" +
            json_array(field.columns[c], field.header, 0, place);
  }
  return text + "}}\n";
}

}  // namespace

Field ask_field(const FieldSource& source, const v1::FieldQuery& query) {
  if (!is_job_folder(source.job)) return ask_server(source, query);
  if (source.fresh) {
    throw Failure(Exit::usage,
                  "--fresh asks a running engine for a checkpoint, which a server does; " + source.job + " is a folder",
                  "leave it out: the newest checkpoint of the folder is taken");
  }
  const auto files = checkpoints_of(source.job, source.step);
  if (files.empty()) {
    throw Failure(Exit::not_found, "the job folder " + source.job + " has no checkpoint" +
                                       (source.step ? " of step " + std::to_string(*source.step) : " yet"));
  }
  for (const auto& file : files) {
    try {
      Field field = ask_file(file, query);
      field.header.set_job(source.job);
      return field;
    } catch (const Failure& failure) {
      if (failure.code != Exit::corrupt || file == files.back()) throw;
      say(std::string(failure.what()) + "; taking the one before");
    }
  }
  return {};
}

void print_field(const Field& field, Format format, bool histogram) {
  const auto& header = field.header;
  if (format == Format::json) return print_data(json_of(field));
  if (histogram) return print_data(histogram_table(header).text(format));
  if (header.reduced_size() > 0) return print_data(reduced_table(header).text(format));
  if (format == Format::table) {
    std::string units;
    for (const auto& column : header.columns()) units += (units.empty() ? "" : ", ") + column.name() + " in " + column.unit();
    say("step " + std::to_string(header.step()) + ", t = " + number_text(header.time()) + " s" +
        (header.has_place() ? ", layer at " + number_text(header.place()) + " m" : "") +
        (header.has_particles() ? ", " + std::to_string(header.particles()) + " particles in the region" : "") + "; " + units);
  }
  print_data(long_form(field).text(format));
}

}  // namespace bedflow::client
