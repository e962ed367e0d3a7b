#include "plot.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "gnuplot.h"
#include "table.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

constexpr int panel_width = 800, panel_height = 480, title_height = 56;
constexpr const char* ours = "#1f5fa8";
constexpr const char* band = "#c9dcf2";
constexpr const char* measured = "#c0392b";

std::string number(double value) {
  return std::isfinite(value) ? number_text(value) : "NaN";
}

std::string spaced(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

// Lengths below a metre are drawn in millimetres.
struct Scale {
  double factor = 1;
  std::string unit;
};
Scale scale_of(const std::string& unit, double largest) {
  if (unit == "m" && largest < 1) return {1e3, "mm"};
  return {1, unit};
}
std::string label(const std::string& quantity, const std::string& unit) {
  return gnuplot_quoted(unit.empty() || unit == "1" ? quantity : quantity + "  /  " + unit);
}

double largest(const google::protobuf::RepeatedField<double>& values) {
  double most = 0;
  for (const double value : values) {
    if (std::isfinite(value)) most = std::max(most, std::abs(value));
  }
  return most;
}

const v1::Monitor* monitor_of(const std::optional<v1::Case>& value, const std::string& name) {
  if (!value) return nullptr;
  for (const auto& monitor : value->monitors()) {
    if (monitor.name() == name) return &monitor;
  }
  return nullptr;
}

std::vector<const v1::Reference*> references_of(const std::optional<v1::Case>& value, const std::string& name) {
  std::vector<const v1::Reference*> found;
  if (!value) return found;
  for (const auto& reference : value->references()) {
    if (reference.monitor() == name) found.push_back(&reference);
  }
  return found;
}

class Panel {
 public:
  Panel(std::string name, std::string title) : block_("$" + std::move(name)), title_(std::move(title)) {}

  void axes(const std::string& x_label, const std::string& y_label) {
    head_ += "set title " + gnuplot_quoted(title_) + " font \",15\"\nset xlabel " + x_label + " offset 0,0.4\nset ylabel " +
             y_label + "\n";
  }
  // Starts a block of data; returns its name.
  std::string block(const std::string& rows) {
    std::string name = block_ + "_" + std::to_string(blocks_++);
    head_ = name + " << EOD\n" + rows + "EOD\n" + head_;
    return name;
  }
  void draw(const std::string& what) { draws_.push_back(what); }
  std::string script() const {
    std::string text = head_ + "plot ";
    for (std::size_t i = 0; i < draws_.size(); ++i) text += (i ? ", \\\n  " : "") + draws_[i];
    return text + "\n";
  }

 private:
  std::string block_, title_, head_;
  std::vector<std::string> draws_;
  int blocks_ = 0;
};

std::string row(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + number(value);
  return text + "\n";
}

// Reference means without a place hold over the whole time: a dashed line, with its interval where it has one.
void draw_references(Panel& panel, const std::vector<const v1::Reference*>& references, double x_factor, double factor,
                     double from, double to) {
  int symbol = 6;  // open circle, then open triangle, square, diamond
  for (const auto* reference : references) {
    const std::string title = " title " + gnuplot_quoted(reference->source()) + " ";
    std::string points;
    bool intervals = false;
    for (const auto& point : reference->points()) {
      const double value = point.value() * factor, half = point.half_width() * factor;
      if (point.has_x()) {
        points += row({point.x() * x_factor, value, half});
        intervals = intervals || point.has_half_width();
        continue;
      }
      const auto line =
          panel.block(row({from, value, value - half, value + half}) + row({to, value, value - half, value + half}));
      if (point.has_half_width())
        panel.draw(line + " using 1:3:4 with filledcurves fc rgb \"" + measured + "\" fs transparent solid 0.12 notitle");
      panel.draw(line + " using 1:2 with lines dt 2 lw 1.6 lc rgb \"" + measured + "\"" + title);
    }
    if (points.empty()) continue;
    const std::string style = " pt " + std::to_string(symbol) + " ps 1.1 lw 1.2 lc rgb \"" + measured + "\"" + title;
    panel.draw(panel.block(points) + (intervals ? " using 1:2:3 with yerrorbars" : " using 1:2 with points") + style);
    symbol = symbol == 6 ? 8 : symbol == 8 ? 4 : 12;
  }
}

std::string series_panel(const v1::Series& series, const std::optional<v1::Case>& value, int index) {
  const auto y =
      scale_of(series.unit(), std::max({largest(series.value()), largest(series.minimum()), largest(series.maximum())}));
  Panel panel("series" + std::to_string(index), spaced(series.name()));
  panel.axes(label("time", "s"), label(spaced(series.name()), y.unit));
  std::string rows;
  const bool thinned = series.minimum_size() == series.value_size() && series.maximum_size() == series.value_size();
  for (int i = 0; i < series.value_size(); ++i) {
    const double low = thinned ? series.minimum(i) : series.value(i), high = thinned ? series.maximum(i) : series.value(i);
    rows += row({series.time(i), series.value(i) * y.factor, low * y.factor, high * y.factor});
  }
  const double end = series.time_size() ? series.time(series.time_size() - 1) : 0;
  const auto* monitor = monitor_of(value, series.name());
  const bool averaged = series.average().bins() > 0;
  // The mean of the bins, drawn over the time that they cover.
  const bool known = monitor != nullptr && monitor->has_averaging();
  const double from = known ? monitor->averaging().start() : series.time_size() ? series.time(0) : 0;
  const double to = known && averaged ? from + monitor->averaging().bin() * series.average().bins() : end;
  const double mean = series.average().mean() * y.factor, half = series.average().half_width() * y.factor;
  const bool interval = averaged && series.average().has_half_width();
  const auto bins =
      averaged ? panel.block(row({from, mean, mean - half, mean + half}) + row({to, mean, mean - half, mean + half})) : "";
  if (interval) panel.draw(bins + " using 1:3:4 with filledcurves fc rgb \"" + band + "\" title \"95 % interval of the mean\"");
  const auto samples = panel.block(rows.empty() ? row({NAN, NAN, NAN, NAN}) : rows);
  if (thinned) panel.draw(samples + " using 1:3:4 with filledcurves fc rgb \"" + ours + "\" fs transparent solid 0.35 notitle");
  panel.draw(samples + " using 1:2 with lines lw 1.3 lc rgb \"" + ours + "\" title \"bedflow\"");
  if (averaged) {
    const std::string title =
        "mean of " + std::to_string(series.average().bins()) + (series.average().bins() == 1 ? " bin" : " bins");
    panel.draw(bins + " using 1:2 with lines lw 2.2 lc rgb \"#0b2e59\" title " + gnuplot_quoted(title));
  }
  draw_references(panel, references_of(value, series.name()), 1, y.factor, series.time_size() ? series.time(0) : 0, end);
  return panel.script();
}

std::string profile_panel(const v1::Profile& profile, const std::optional<v1::Case>& value, int index) {
  const auto x = scale_of("m", largest(profile.place()));
  double most = 0;
  bool intervals = false;
  for (const auto& estimate : profile.average()) {
    if (std::isfinite(estimate.mean())) most = std::max(most, std::abs(estimate.mean()));
    intervals = intervals || estimate.has_half_width();
  }
  const auto y = scale_of(profile.unit(), most);
  Panel panel("profile" + std::to_string(index), spaced(profile.name()));
  panel.axes(label("place", x.unit), label(spaced(profile.name()), y.unit));
  std::string rows;
  for (int i = 0; i < std::min(profile.place_size(), profile.average_size()); ++i) {
    const auto& estimate = profile.average(i);
    const double mean = estimate.bins() > 0 ? estimate.mean() : NAN;
    rows += row({profile.place(i) * x.factor, mean * y.factor, estimate.half_width() * y.factor});
  }
  const auto data = panel.block(rows.empty() ? row({NAN, NAN, NAN}) : rows);
  panel.draw(data + " using 1:2 with lines lw 1 lc rgb \"" + ours + "\" notitle");
  panel.draw(data + (intervals ? " using 1:2:3 with yerrorbars" : " using 1:2 with points") + " pt 7 ps 0.9 lw 1.3 lc rgb \"" +
             ours + "\" title \"" + (intervals ? "bedflow, 95 % interval" : "bedflow") + "\"");
  draw_references(panel, references_of(value, profile.name()), x.factor, y.factor, 0, 0);
  return panel.script();
}

}  // namespace

std::string plot_script(const v1::Statistics& statistics, const std::optional<v1::Case>& value, const std::string& job,
                        const std::filesystem::path& file) {
  const int panels = statistics.series_size() + statistics.profiles_size();
  const int columns = panels > 2 ? 2 : 1;
  const int rows = (panels + columns - 1) / columns;
  std::string text = picture_head(file, {columns * panel_width, rows * panel_height + title_height});
  std::string title = (value ? value->name() + "    " : "") + job;
  title += "    step " + std::to_string(statistics.step()) + ", t = " + number(statistics.time()) + " s";
  text += "set multiplot layout " + std::to_string(rows) + "," + std::to_string(columns) + " title " + gnuplot_quoted(title) +
          " font \",16\"\n";
  text += "set key below center horizontal Left reverse samplen 2 spacing 1.1 width 2 nobox\n";
  int index = 0;
  for (const auto& series : statistics.series()) text += series_panel(series, value, index++);
  for (const auto& profile : statistics.profiles()) text += profile_panel(profile, value, index++);
  return text + "unset multiplot\nunset output\n";
}

}  // namespace bedflow::client
