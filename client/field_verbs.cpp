// field slice, profile, sample, reduce: what a checkpoint holds, without moving the file.
#include <charconv>

#include "field.h"
#include "terminal.h"
#include "verbs.h"

namespace bedflow::client {

namespace {

struct FieldOptions {
  FieldSource source;
  std::vector<std::string> quantities;
  std::array<std::string, 3> ranges;  // "LOW:HIGH" of x, y, z
  v1::FieldAxis axis = v1::FIELD_Y;
  std::optional<double> place, low, high;
  std::optional<std::uint32_t> bins;
  std::uint32_t most = 20;
  std::uint64_t seed = 0;
  Format format = Format::table;
};

[[noreturn]] void refuse_range(const std::string& range) {
  throw Failure(Exit::usage, "\"" + range + "\" is no range: it is LOW:HIGH in m, either of which may be left out",
                "bedflow field --help");
}

std::optional<double> edge_of(const std::string& range, const std::string& text) {
  if (text.empty()) return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) refuse_range(range);
  return value;
}

// "0.01:0.02", ":0.02", "0.01:".
void set_range(const std::string& range, const std::function<void(double)>& set_low,
               const std::function<void(double)>& set_high) {
  if (range.empty()) return;
  const auto colon = range.find(':');
  if (colon == range.npos) refuse_range(range);
  if (const auto low = edge_of(range, range.substr(0, colon))) set_low(*low);
  if (const auto high = edge_of(range, range.substr(colon + 1))) set_high(*high);
}

v1::FieldQuery query_of(const FieldOptions& options) {
  v1::FieldQuery query;
  for (const auto& name : options.quantities) query.add_quantities(name);
  auto& region = *query.mutable_region();
  set_range(
      options.ranges[0], [&](double v) { region.set_x_low(v); }, [&](double v) { region.set_x_high(v); });
  set_range(
      options.ranges[1], [&](double v) { region.set_y_low(v); }, [&](double v) { region.set_y_high(v); });
  set_range(
      options.ranges[2], [&](double v) { region.set_z_low(v); }, [&](double v) { region.set_z_high(v); });
  return query;
}

Exit ask_and_print(const Program& program, const FieldOptions& options, const v1::FieldQuery& query, bool histogram = false) {
  auto source = options.source;
  source.server = program.server;
  print_field(ask_field(source, query), options.format, histogram);
  return Exit::ok;
}

Exit slice(const Program& program, const FieldOptions& options) {
  auto query = query_of(options);
  query.mutable_slice()->set_axis(options.axis);
  if (options.place) query.mutable_slice()->set_place(*options.place);
  return ask_and_print(program, options, query);
}

Exit profile(const Program& program, const FieldOptions& options) {
  auto query = query_of(options);
  query.mutable_profile()->set_axis(options.axis);
  if (options.bins) query.mutable_profile()->set_bins(*options.bins);
  return ask_and_print(program, options, query);
}

Exit sample(const Program& program, const FieldOptions& options) {
  auto query = query_of(options);
  query.mutable_sample()->set_most(options.most);
  query.mutable_sample()->set_seed(options.seed);
  return ask_and_print(program, options, query);
}

Exit reduce(const Program& program, const FieldOptions& options) {
  auto query = query_of(options);
  auto& reduction = *query.mutable_reduction();
  if (options.bins) reduction.set_histogram_bins(*options.bins);
  if (options.low) reduction.set_histogram_low(*options.low);
  if (options.high) reduction.set_histogram_high(*options.high);
  return ask_and_print(program, options, query, options.bins.has_value());
}

using Verb = Exit (*)(const Program&, const FieldOptions&);

std::shared_ptr<FieldOptions> add_verb(CLI::App& field, Program& program, const char* name, const char* meaning, Verb function) {
  auto options = std::make_shared<FieldOptions>();
  auto* verb = field.add_subcommand(name, meaning);
  verb->add_option("job", options->source.job, "id of the job, or its folder")->required();
  verb->add_option("quantity", options->quantities, "what of it; `bedflow checkpoint get JOB` lists them");
  verb->add_option("--step", options->source.step, "checkpoint of this step; the newest good one if absent");
  verb->add_flag("--fresh", options->source.fresh, "have a running job write a checkpoint now, and ask that");
  const std::array<const char*, 3> names = {"--x", "--y", "--z"};
  for (std::size_t d = 0; d < 3; ++d)
    verb->add_option(names[d], options->ranges[d], "only this part of the box, m")->type_name("LOW:HIGH");
  add_format(verb, options->format);
  on_call(verb, program, options, function);
  return options;
}

void add_axis(CLI::App* verb, v1::FieldAxis& axis, const char* meaning, const char* otherwise) {
  static const std::map<std::string, v1::FieldAxis> axes = {{"x", v1::FIELD_X}, {"y", v1::FIELD_Y}, {"z", v1::FIELD_Z}};
  verb->add_option("--axis", axis, meaning)
      ->transform(CLI::CheckedTransformer(axes).description(""))
      ->type_name("x|y|z")
      ->default_str(otherwise);
}

}  // namespace

void add_field_verbs(CLI::App& app, Program& program) {
  auto* field = app.add_subcommand("field", "slices, profiles, particles and sums of a checkpoint, or of a running job's newest");
  field->require_subcommand(1);

  auto options = add_verb(*field, program, "slice", "the cells of one layer", slice);
  auto* verb = field->get_subcommand("slice");
  options->axis = v1::FIELD_Z;
  add_axis(verb, options->axis, "across this axis", "z");
  verb->add_option("--at", options->place, "the layer that holds this place, m; the middle if absent");

  options = add_verb(*field, program, "profile", "means along an axis, with minimum and maximum", profile);
  verb = field->get_subcommand("profile");
  add_axis(verb, options->axis, "along this axis", "y");
  verb->add_option("--bins", options->bins, "bins for particles; as many as the grid has cells if absent")
      ->check(CLI::PositiveNumber);

  options = add_verb(*field, program, "sample", "some of the particles, the same ones for the same seed", sample);
  verb = field->get_subcommand("sample");
  verb->add_option("--most", options->most, "so many at most")->check(CLI::PositiveNumber)->capture_default_str();
  verb->add_option("--seed", options->seed, "of the choice")->capture_default_str();

  options = add_verb(*field, program, "reduce", "minimum, maximum, mean, deviation and integral; or a histogram", reduce);
  verb = field->get_subcommand("reduce");
  verb->add_option("--histogram", options->bins, "the share of each of so many bins instead")->check(CLI::PositiveNumber);
  verb->add_option("--from", options->low, "lower end of the histogram; the minimum if absent");
  verb->add_option("--to", options->high, "upper end of the histogram; the maximum if absent");
}

}  // namespace bedflow::client
