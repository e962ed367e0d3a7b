#include "report/field_answer.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cmath>

#include "bedflow/v1/fields.pb.h"
#include "fields/questions.h"

namespace bedflow {

namespace {

constexpr std::size_t values_a_part = 1 << 16;

SliceQuestion question_of(const v1::FieldSlice& asked) {
  SliceQuestion question{.axis = asked.axis()};
  if (asked.has_place()) question.place = asked.place();
  return question;
}
ProfileQuestion question_of(const v1::FieldProfile& asked) {
  ProfileQuestion question{.axis = asked.axis()};
  if (asked.has_bins()) question.bins = static_cast<int>(std::min(asked.bins(), 0x7fffffffU));
  return question;
}
SampleQuestion question_of(const v1::FieldSample& asked) {
  return {asked.most(), asked.seed()};
}
ReductionQuestion question_of(const v1::FieldReduction& asked) {
  ReductionQuestion question{.histogram_bins = static_cast<int>(std::min(asked.histogram_bins(), 0x7fffffffU))};
  if (asked.has_histogram_low()) question.low = asked.histogram_low();
  if (asked.has_histogram_high()) question.high = asked.histogram_high();
  return question;
}

Question question_of(const std::string& text) {
  v1::FieldQuery query;
  if (!google::protobuf::TextFormat::ParseFromString(text, &query)) throw FieldRefusal("the question cannot be read");
  Question question;
  question.quantities = {query.quantities().begin(), query.quantities().end()};
  const v1::FieldRegion& region = query.region();
  if (region.has_x_low()) question.low[0] = region.x_low();
  if (region.has_y_low()) question.low[1] = region.y_low();
  if (region.has_z_low()) question.low[2] = region.z_low();
  if (region.has_x_high()) question.high[0] = region.x_high();
  if (region.has_y_high()) question.high[1] = region.y_high();
  if (region.has_z_high()) question.high[2] = region.z_high();
  switch (query.what_case()) {
    case v1::FieldQuery::kSlice:
      question.what = question_of(query.slice());
      break;
    case v1::FieldQuery::kProfile:
      question.what = question_of(query.profile());
      break;
    case v1::FieldQuery::kSample:
      question.what = question_of(query.sample());
      break;
    case v1::FieldQuery::kReduction:
      question.what = question_of(query.reduction());
      break;
    case v1::FieldQuery::WHAT_NOT_SET:
      throw FieldRefusal("the question is none of slice, profile, sample and reduction");
  }
  return question;
}

void fill(v1::FieldQuantity& message, const Quantity& quantity) {
  message.set_name(quantity.name);
  message.set_unit(quantity.unit);
  message.set_meaning(quantity.meaning);
  message.set_of_particles(quantity.of_particles);
}

void fill(v1::FieldReduced& message, const Reduced& reduced) {
  fill(*message.mutable_quantity(), reduced.quantity);
  if (reduced.minimum) message.set_minimum(*reduced.minimum);
  if (reduced.maximum) message.set_maximum(*reduced.maximum);
  if (reduced.mean) message.set_mean(*reduced.mean);
  if (reduced.deviation) message.set_deviation(*reduced.deviation);
  message.set_integral(reduced.integral);
  message.set_integral_unit(reduced.integral_unit);
  message.set_weight(reduced.weight);
  if (reduced.histogram.empty()) return;
  message.set_histogram_low(reduced.histogram_low);
  message.set_histogram_high(reduced.histogram_high);
  message.mutable_histogram()->Assign(reduced.histogram.begin(), reduced.histogram.end());
}

v1::FieldAnswer header_of(const FieldSource& source, const Answer& answer) {
  v1::FieldAnswer message;
  v1::FieldHeader& header = *message.mutable_header();
  header.set_step(source.reader().step());
  header.set_time(source.reader().time());
  for (const Quantity& quantity : answer.columns) fill(*header.add_columns(), quantity);
  header.mutable_shape()->Assign(answer.shape.begin(), answer.shape.end());
  for (const Places& places : answer.axes) {
    v1::FieldPlaces& axis = *header.add_axes();
    axis.set_name(std::string(1, "xyz"[places.axis]));
    axis.set_unit("m");
    axis.mutable_place()->Assign(places.values.begin(), places.values.end());
  }
  if (answer.place) header.set_place(*answer.place);
  if (answer.particles) header.set_particles(*answer.particles);
  for (const Reduced& reduced : answer.reduced) fill(*header.add_reduced(), reduced);
  return message;
}

const char* name_of(Dataset::Type type) {
  return type == Dataset::Type::real ? "real" : type == Dataset::Type::integer ? "integer" : "byte";
}

}  // namespace

void answer_field(const std::filesystem::path& checkpoint, const std::string& query,
                  const std::function<void(const std::string&)>& send) {
  const Question question = question_of(query);
  const FieldSource source(checkpoint);
  const Answer found = answer(source, question);
  send(header_of(source, found).SerializeAsString());
  for (std::size_t column = 0; column < found.values.size(); ++column) {
    const std::vector<double>& values = found.values[column];
    for (std::size_t first = 0; first < values.size(); first += values_a_part) {
      v1::FieldAnswer message;
      message.mutable_values()->set_column(static_cast<std::uint32_t>(column));
      message.mutable_values()->set_offset(first);
      const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
      const auto count = static_cast<std::ptrdiff_t>(std::min(values_a_part, values.size() - first));
      message.mutable_values()->mutable_value()->Assign(begin, begin + count);
      send(message.SerializeAsString());
    }
  }
}

std::string describe_checkpoint(const std::filesystem::path& checkpoint) {
  const FieldSource source(checkpoint);
  v1::CheckpointReport report;
  report.set_step(source.reader().step());
  report.set_time(source.reader().time());
  report.set_bytes(std::filesystem::file_size(checkpoint));
  report.set_ranks(static_cast<std::uint32_t>(source.reader().ranks()));
  for (const auto& [name, value] : source.reader().numbers()) (*report.mutable_numbers())[name] = value;
  for (const Dataset& dataset : source.reader().datasets()) {
    v1::CheckpointArrayReport& array = *report.add_arrays();
    array.set_name(dataset.name);
    array.set_unit(dataset.unit);
    array.set_meaning(dataset.meaning);
    array.mutable_shape()->Assign(dataset.shape.begin(), dataset.shape.end());
    array.set_type(name_of(dataset.type));
  }
  for (const Quantity& quantity : source.quantities()) fill(*report.add_quantities(), quantity);
  return report.SerializeAsString();
}

}  // namespace bedflow
