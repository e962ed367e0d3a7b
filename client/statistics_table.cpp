#include "statistics_table.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "terminal.h"

namespace bedflow::client {

namespace {

Cell mean_cell(const v1::Estimate& estimate) {
  return estimate.bins() > 0 ? Cell(estimate.mean()) : Cell();
}
Cell half_cell(const v1::Estimate& estimate) {
  return estimate.has_half_width() ? Cell(estimate.half_width()) : Cell();
}
Cell last_cell(const v1::Series& series) {
  return series.value_size() ? Cell(series.value(series.value_size() - 1)) : Cell();
}

// A line a series, and a line a place of a profile.
Table long_form(const v1::Statistics& statistics) {
  Table table({"name", "unit", "place_m", "samples", "last", "mean", "half_width", "bins", "deviation", "deviation_half_width"});
  for (const auto& one : statistics.series()) {
    table.add({one.name(),
               one.unit(),
               {},
               static_cast<std::uint64_t>(one.value_size()),
               last_cell(one),
               mean_cell(one.average()),
               half_cell(one.average()),
               std::uint64_t{one.average().bins()},
               mean_cell(one.deviation()),
               half_cell(one.deviation())});
  }
  for (const auto& one : statistics.profiles()) {
    for (int i = 0; i < std::min(one.place_size(), one.average_size()); ++i) {
      const auto deviation = i < one.deviation_size() ? one.deviation(i) : v1::Estimate();
      table.add({one.name(),
                 one.unit(),
                 one.place(i),
                 {},
                 {},
                 mean_cell(one.average(i)),
                 half_cell(one.average(i)),
                 std::uint64_t{one.average(i).bins()},
                 mean_cell(deviation),
                 half_cell(deviation)});
    }
  }
  return table;
}

std::string for_people(const v1::Statistics& statistics) {
  std::string text;
  if (statistics.series_size() > 0) {
    Table table({"series", "samples", "last", "mean ± 95 %", "deviation ± 95 %", "bins", "unit"});
    for (const auto& one : statistics.series()) {
      table.add({one.name(), static_cast<std::uint64_t>(one.value_size()), last_cell(one), estimate_text(one.average()),
                 estimate_text(one.deviation()), std::uint64_t{one.average().bins()}, one.unit()});
    }
    text += table.text(Format::table);
  }
  for (const auto& one : statistics.profiles()) {
    const Terminal terminal(stdout);
    std::uint32_t bins = 0;
    for (const auto& estimate : one.average()) bins = std::max(bins, estimate.bins());
    text += (text.empty() ? "" : "\n") + terminal.paint(Colour::bold, one.name()) + "  " + one.unit() + ", " +
            std::to_string(bins) + (bins == 1 ? " bin of time\n" : " bins of time\n");
    Table table({"place / mm", "mean ± 95 %", "deviation ± 95 %"});
    for (int i = 0; i < std::min(one.place_size(), one.average_size()); ++i) {
      table.add(
          {1e3 * one.place(i), estimate_text(one.average(i)), i < one.deviation_size() ? estimate_text(one.deviation(i)) : "-"});
    }
    text += table.text(Format::table);
  }
  return text;
}

}  // namespace

std::string estimate_text(const v1::Estimate& estimate) {
  if (estimate.bins() == 0 || !std::isfinite(estimate.mean())) return "-";
  const double half = estimate.half_width();
  if (!estimate.has_half_width() || !std::isfinite(half) || half <= 0) return number_text(estimate.mean());
  const int digits = 1 - static_cast<int>(std::floor(std::log10(half)));  // two of the half-width
  std::array<char, 96> text{};
  if (digits > 9 || digits < -3) {
    std::snprintf(text.data(), text.size(), "%.6g ± %.1e", estimate.mean(), half);
  } else {
    const int decimals = std::max(digits, 0);
    std::snprintf(text.data(), text.size(), "%.*f ± %.*f", decimals, estimate.mean(), decimals, half);
  }
  return text.data();
}

void print_statistics(const v1::Statistics& statistics, Format format) {
  if (format == Format::table) return print_data(for_people(statistics));
  print_message(statistics, long_form(statistics), format);
}

void print_samples(const v1::Statistics& statistics, Format format) {
  const auto& all = statistics.series();
  const bool thinned = std::any_of(all.begin(), all.end(), [](const v1::Series& one) { return one.samples_size() > 0; });
  std::vector<std::string> columns = {"name", "step", "time_s", "value"};
  if (thinned) columns.insert(columns.end(), {"minimum", "maximum", "samples"});
  Table table(columns);
  for (const auto& one : all) {
    for (int i = 0; i < one.value_size(); ++i) {
      std::vector<Cell> row = {one.name(), one.step(i), one.time(i), one.value(i)};
      if (i < one.samples_size()) {
        row.insert(row.end(), {one.minimum(i), one.maximum(i), std::uint64_t{one.samples(i)}});
      } else if (thinned) {
        row.insert(row.end(), {one.value(i), one.value(i), std::uint64_t{1}});
      }
      table.add(std::move(row));
    }
  }
  print_data(table.text(format));
}

}  // namespace bedflow::client
