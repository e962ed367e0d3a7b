#include "study_report.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "failure.h"
#include "gnuplot.h"
#include "statistics_table.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

constexpr int panel_width = 820, panel_height = 560, title_height = 56;

// Of every axis along which a point differs from the reference what `say` makes of it, with `between` in between.
template <class Say>
std::string differences(const v1::StudySpec& spec, int point, const char* between, Say say) {
  const auto& reference = spec.points(static_cast<int>(spec.reference()));
  std::string text;
  for (int a = 0; a < spec.axes_size(); ++a)
    if (spec.points(point).values(a) != reference.values(a)) text += (text.empty() ? "" : between) + say(a);
  return text;
}
std::string values_of(const v1::StudySpec& spec, int point) {
  return differences(spec, point, ", ", [&](int axis) { return spec.points(point).values(axis); });
}
std::string axes_of(const v1::StudySpec& spec, int point) {
  return differences(spec, point, " and ", [&](int axis) { return spec.axes(axis); });
}

bool has_error(const v1::StudyRun& run, int quantity) {
  return quantity < run.errors_size() && run.errors(quantity).has_value();
}

const v1::Estimate& reference_of(const v1::Study& study, int quantity) {
  static const v1::Estimate none;
  const auto& run = study.runs(static_cast<int>(study.spec().reference()));
  return quantity < run.quantities_size() ? run.quantities(quantity) : none;
}

// In per cent of the reference's magnitude.
double relative(const v1::Study& study, int quantity, double value) {
  return 100 * value / std::abs(reference_of(study, quantity).mean());
}

std::string short_text(double value, int digits = 2) {
  char text[32];
  if (std::abs(value) >= std::pow(10, digits))
    std::snprintf(text, sizeof text, "%.0f", value);
  else
    std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

std::string error_text(const v1::Study& study, int point, int quantity) {
  const auto& run = study.runs(point);
  if (point == static_cast<int>(study.spec().reference())) return "reference";
  if (!has_error(run, quantity)) return "-";
  const auto& error = run.errors(quantity);
  std::string text = short_text(relative(study, quantity, error.value())) + " %";
  if (error.has_half_width()) text += " ± " + short_text(relative(study, quantity, error.half_width()));
  return text + (error.equal() ? ", equal" : "") + (quantity < run.on_front_size() && run.on_front(quantity) ? " *" : "");
}

std::string run_state(const v1::StudyRun& run) {
  if (!run.has_job()) return "waiting";
  if (run.reused() && run.state() == v1::SUCCEEDED) return "reused";
  if (run.interval_met()) return "interval met";
  std::string text = run.has_state() ? state_name(run.state()) : "submitted";
  if (run.state() == v1::RUNNING) text += " " + short_text(100 * run.done()) + " %";
  if (run.state() == v1::FAILED) text += " " + reason_name(run.reason());
  return text;
}

Table long_form(const v1::Study& study) {
  std::vector<std::string> columns = {"run"};
  for (const auto& axis : study.spec().axes()) columns.push_back(axis);
  for (const char* name : {"job", "state", "quantity", "mean", "half_width", "bins", "error", "error_half_width", "equal",
                           "on_front", "cpu_seconds_per_simulated_second"})
    columns.emplace_back(name);
  Table table(columns);
  for (int i = 0; i < study.runs_size(); ++i) {
    const auto& run = study.runs(i);
    for (int q = 0; q < study.spec().quantities_size(); ++q) {
      std::vector<Cell> row = {static_cast<std::uint64_t>(i)};
      for (const auto& value : study.spec().points(i).values()) row.emplace_back(value);
      const auto estimate = q < run.quantities_size() ? run.quantities(q) : v1::Estimate();
      const auto error = q < run.errors_size() ? run.errors(q) : v1::StudyError();
      const auto number = [](bool there, double value) { return there ? Cell(value) : Cell(); };
      row.emplace_back(run.job());
      row.emplace_back(run_state(run));
      row.emplace_back(quantity_name(study.spec().quantities(q)));
      row.push_back(number(estimate.has_mean(), estimate.mean()));
      row.push_back(number(estimate.has_half_width(), estimate.half_width()));
      row.emplace_back(std::uint64_t{estimate.bins()});
      row.push_back(number(error.has_value(), error.value()));
      row.push_back(number(error.has_half_width(), error.half_width()));
      row.push_back(error.has_equal() ? Cell(error.equal()) : Cell());
      row.push_back(q < run.on_front_size() ? Cell(run.on_front(q)) : Cell());
      row.push_back(number(run.has_cost(), run.cost().cpu_seconds()));
      table.add(std::move(row));
    }
  }
  return table;
}

// "20, 30, 50, 100": gnuplot's own are decades, and studies seldom span one.
std::string log_tics(double low, double high) {
  std::string text;
  for (double decade = std::pow(10, std::floor(std::log10(low))); decade < high; decade *= 10) {
    for (const int step : {1, 2, 3, 5, 7})
      if (step * decade >= low && step * decade <= high) text += (text.empty() ? "" : ", ") + number_text(step * decade);
  }
  return text;
}

// In a picture of many points only these are named: those that differ, and those that cost another amount than the reference.
bool stands_out(const v1::Study& study, int point, int quantity) {
  constexpr int many = 12;
  constexpr double another_amount = 1.25;
  const auto& run = study.runs(point);
  const double speed_up = study.runs(static_cast<int>(study.spec().reference())).cost().cpu_seconds() / run.cost().cpu_seconds();
  return study.runs_size() <= many || !run.errors(quantity).equal() || speed_up > another_amount || speed_up < 1 / another_amount;
}

// One point of a line in the picture: cost, error and interval in per cent, and what to write beside it.
std::string plot_row(const v1::Study& study, int point, int quantity) {
  const auto& run = study.runs(point);
  if (!run.has_cost() || !has_error(run, quantity)) return {};
  const auto& error = run.errors(quantity);
  const bool is_reference = point == static_cast<int>(study.spec().reference());
  const double value = relative(study, quantity, error.value()), half = relative(study, quantity, error.half_width());
  return number_text(run.cost().cpu_seconds()) + " " + number_text(value) + " " + number_text(is_reference ? 0 : half) + " " +
         gnuplot_quoted(stands_out(study, point, quantity) ? values_of(study.spec(), point) : "") + "\n";
}

}  // namespace

bool has_ended(const v1::StudyRun& run) {
  return run.interval_met() || (run.has_state() && is_final(run.state()) && run.state() != v1::STATE_SUSPENDED);
}

std::string quantity_name(const v1::StudyQuantity& quantity) {
  return quantity.monitor() + (quantity.fluctuation() ? " fluctuation" : "");
}

std::string study_state_name(v1::StudyState state) {
  return v1::StudyState_Name(state).substr(6);
}

std::string point_name(const v1::StudySpec& spec, int point) {
  const auto name =
      differences(spec, point, " ", [&](int axis) { return spec.axes(axis) + "=" + spec.points(point).values(axis); });
  return name.empty() ? "reference" : name;
}

std::string reference_text(const v1::Study& study) {
  const auto& spec = study.spec();
  std::string text;
  for (int a = 0; a < spec.axes_size(); ++a)
    text += (a ? " " : "") + spec.axes(a) + "=" + spec.points(static_cast<int>(spec.reference())).values(a);
  return text;
}

Table study_table(const v1::Study& study) {
  const auto& spec = study.spec();
  std::vector<std::string> columns = {"run", "state", "CPU s/s", "speed-up"};
  for (const auto& quantity : spec.quantities()) {
    columns.push_back(quantity_name(quantity) + " ± 95 %");
    columns.emplace_back("difference");
  }
  Table table(columns);
  const auto& reference = study.runs(static_cast<int>(spec.reference()));
  for (int i = 0; i < study.runs_size(); ++i) {
    const auto& run = study.runs(i);
    std::vector<Cell> row = {point_name(spec, i), run_state(run)};
    row.emplace_back(run.has_cost() ? short_text(run.cost().cpu_seconds(), 3) : "-");
    const bool comparable = run.has_cost() && reference.has_cost();
    row.emplace_back(comparable ? short_text(reference.cost().cpu_seconds() / run.cost().cpu_seconds(), 3) + " x" : "-");
    for (int q = 0; q < spec.quantities_size(); ++q) {
      row.emplace_back(q < run.quantities_size() ? estimate_text(run.quantities(q)) : "-");
      row.emplace_back(error_text(study, i, q));
    }
    table.add(std::move(row));
  }
  return table;
}

void print_study(const v1::Study& study, Format format) {
  if (format == Format::table) {
    print_data(study_table(study).text(format));
    say("reference: " + reference_text(study) + "\n* no other run is both cheaper and closer");
    if (!study.message().empty()) say(study.message());
    return;
  }
  print_message(study, long_form(study), format);
}

Table table_of(const std::vector<v1::Study>& studies) {
  Table table({"study", "name", "state", "runs", "ended", "created"});
  for (const auto& study : studies) {
    const auto ended = std::ranges::count_if(study.runs(), has_ended);
    table.add({study.id(), study.spec().name(), study_state_name(study.state()), static_cast<std::uint64_t>(study.runs_size()),
               static_cast<std::uint64_t>(ended), time_text(study.created_unix_nanos())});
  }
  return table;
}

std::string study_plot(const v1::Study& study, const std::filesystem::path& file) {
  const auto& spec = study.spec();
  const int panels = spec.quantities_size(), columns = panels > 1 ? 2 : 1, rows = (panels + columns - 1) / columns;
  std::string text = picture_head(file, {columns * panel_width, rows * panel_height + title_height});
  text += "set multiplot layout " + std::to_string(rows) + "," + std::to_string(columns) + " title " +
          gnuplot_quoted(spec.name() + "    " + study.id()) + " font \",16\"\n";
  double cheapest = 1e300, dearest = 0;
  for (const auto& run : study.runs()) {
    if (!run.has_cost()) continue;
    cheapest = std::min(cheapest, run.cost().cpu_seconds());
    dearest = std::max(dearest, run.cost().cpu_seconds());
  }
  text += "set key below center maxrows 1 Left reverse samplen 2 nobox height 1.2\nset logscale x\n";
  if (dearest > 0) {
    text += "set xrange [" + number_text(0.8 * cheapest) + ":" + number_text(1.4 * dearest) + "]\n";
    text += "set xtics (" + log_tics(0.8 * cheapest, 1.4 * dearest) + ")\n";
  }
  std::set<std::string> lines;
  for (int i = 0; i < spec.points_size(); ++i) lines.insert(axes_of(spec, i));
  lines.erase("");
  for (int q = 0; q < panels; ++q) {
    std::string front, draws;
    for (int i = 0; i < spec.points_size(); ++i)
      if (q < study.runs(i).on_front_size() && study.runs(i).on_front(q)) front += plot_row(study, i, q);
    std::size_t index = 0;
    for (const auto& line : lines) {
      std::vector<std::pair<double, std::string>> points;
      for (int i = 0; i < spec.points_size(); ++i) {
        const bool belongs = axes_of(spec, i) == line || i == static_cast<int>(spec.reference());
        if (const auto row = plot_row(study, i, q); belongs && !row.empty())
          points.emplace_back(study.runs(i).cost().cpu_seconds(), row);
      }
      std::ranges::sort(points);
      if (points.size() < 2) continue;
      const std::string block = "$q" + std::to_string(q) + "_" + std::to_string(index);
      text += block + " << EOD\n";
      for (const auto& [cost, row] : points) text += row;
      text += "EOD\n";
      const std::string colour = " rgb \"" + std::string(line_colours[index % line_colours.size()]) + "\"";
      draws += (draws.empty() ? "" : ", \\\n  ") + block + " using 1:2:3 with yerrorlines pt 7 ps 0.9 lw 1.3 lc" + colour +
               " title " + gnuplot_quoted(line) + ", \\\n  " + block +
               " using 1:2:4 with labels left rotate by 45 offset 0.4,0.5 font \",10\" tc" + colour + " notitle";
      ++index;
    }
    text += "set title " + gnuplot_quoted(quantity_name(spec.quantities(q))) + " font \",15\"\n";
    text += "set xlabel \"CPU seconds per simulated second\" offset 0,0.4\nset ylabel \"difference from the reference  /  %\"\n";
    if (!front.empty()) {
      text += "$front" + std::to_string(q) + " << EOD\n" + front + "EOD\n";
      draws += (draws.empty() ? "" : ", \\\n  ") + ("$front" + std::to_string(q)) +
               " using 1:2 with points pt 6 ps 2.2 lw 1.6 lc rgb \"#c0392b\" title \"on the front\"";
    }
    draws += std::string(draws.empty() ? "" : ", \\\n  ") + "0 with lines dt 2 lw 1 lc rgb \"#888888\" notitle";
    text += "plot " + draws + "\n";
  }
  return text + "unset multiplot\nunset output\n";
}

}  // namespace bedflow::client
