// The page of a reproduced bed: tables in Markdown, a picture for each monitor that there is data of.
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "failure.h"
#include "gnuplot.h"
#include "page.h"
#include "reproduction.h"
#include "statistics_table.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

std::string label_of(const ReproducedRun& run) {
  return "ours, " + run.preset;
}

const v1::Series* series_of(const ReproducedRun& run, const std::string& monitor) {
  const auto found = std::ranges::find(run.statistics.series(), monitor, &v1::Series::name);
  return found == run.statistics.series().end() ? nullptr : &*found;
}
const v1::Profile* profile_of(const ReproducedRun& run, const std::string& monitor) {
  const auto found = std::ranges::find(run.statistics.profiles(), monitor, &v1::Profile::name);
  return found == run.statistics.profiles().end() ? nullptr : &*found;
}

// Published values of a monitor, of means or of fluctuations.
std::vector<v1::Reference> references_of(const v1::Case& scene, const std::string& monitor, bool fluctuation) {
  std::vector<v1::Reference> found;
  for (const auto& reference : scene.references())
    if (reference.monitor() == monitor && reference.fluctuation() == fluctuation) found.push_back(reference);
  return found;
}

std::string value_text(double value, double half_width) {
  v1::Estimate estimate;
  estimate.set_bins(1);
  estimate.set_mean(value);
  if (half_width > 0) estimate.set_half_width(half_width);
  return estimate_text(estimate);
}

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%", 100 * share);
  return text;
}

// ------------------------------------------------------------------------------------------------ one value

std::string value_table(const std::vector<const ReproducedRun*>& runs, const std::string& monitor, bool fluctuation) {
  const auto references = references_of(runs.front()->scene, monitor, fluctuation);
  std::string text = "| | value ± 95 % |";
  std::string rule = "|---|---|";
  for (const auto* run : runs) {
    text += " " + label_of(*run) + " |";
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  const auto row = [&](const std::string& name, double value, double half, bool ours) {
    text += "| " + name + " | " + value_text(value, half) + " |";
    for (const auto* run : runs) {
      const auto& estimate = fluctuation ? series_of(*run, monitor)->deviation() : series_of(*run, monitor)->average();
      const double measure = disagreement(value, half, estimate.mean(), estimate.half_width());
      text += ours && label_of(*run) == name ? " |" : measure <= 0 ? " agrees |" : " " + percent(measure) + " apart |";
    }
    text += "\n";
  };
  for (const auto* run : runs) {
    const auto& estimate = fluctuation ? series_of(*run, monitor)->deviation() : series_of(*run, monitor)->average();
    row(label_of(*run), estimate.mean(), estimate.half_width(), true);
  }
  for (const auto& reference : references)
    row(reference.source(), reference.points(0).value(), reference.points(0).half_width(), false);
  return text;
}

void draw_values(const std::filesystem::path& file, const std::vector<const ReproducedRun*>& runs, const std::string& monitor) {
  std::string script = picture_head(file, {1100, 620});
  script += "set multiplot layout 1,2\nset xrange [0:*]\nset lmargin 4\n";
  for (const bool fluctuation : {false, true}) {
    std::string ours, theirs;
    int at = 0;
    const auto put = [&](std::string& rows, double value, double half, const std::string& name) {
      rows += number_text(value) + " " + std::to_string(-at++) + " " + number_text(half) + " " + gnuplot_quoted(name) + "\n";
    };
    for (const auto* run : runs) {
      const auto& estimate = fluctuation ? series_of(*run, monitor)->deviation() : series_of(*run, monitor)->average();
      put(ours, estimate.mean(), estimate.half_width(), label_of(*run));
    }
    for (const auto& reference : references_of(runs.front()->scene, monitor, fluctuation))
      put(theirs, reference.points(0).value(), reference.points(0).half_width(), reference.source());
    const std::string name = fluctuation ? "fluctuation" : "mean";
    const std::string labels = " using (0):($2+0.3):4 with labels left offset 0.6,0 font \",9\" tc rgb \"#444444\" notitle";
    script += "$ours << EOD\n" + ours + "EOD\n$theirs << EOD\n" + (theirs.empty() ? "NaN NaN NaN \"\"\n" : theirs) + "EOD\n";
    script +=
        "set title " + gnuplot_quoted(monitor + ", " + name) + "\nunset ytics\nset yrange [" + std::to_string(-at) + ":0.8]\n";
    script += "set xlabel " + gnuplot_quoted(series_of(*runs.front(), monitor)->unit()) + "\nunset key\n";
    script += "plot $theirs using 1:2:3 with xerrorbars pt 6 ps 1.3 lw 1.4 lc rgb \"#c0392b\", $theirs" + labels +
              ", $ours using 1:2:3 with xerrorbars pt 7 ps 1.3 lw 1.6 lc rgb \"#1f5fa8\", $ours" + labels + "\n";
  }
  draw_picture(script + "unset multiplot\nunset output\n", file);
}

// ------------------------------------------------------------------------------------------------ a profile

struct Curve {
  std::vector<double> place, value, half_width;
};

// Ours mirror-averaged: what the two sides of a symmetric bed differ by is noise, or the experiment's offset.
Curve curve_of(const v1::Profile& profile) {
  Curve curve;
  for (int i = 0; i < std::min(profile.place_size(), profile.average_size()); ++i) {
    curve.place.push_back(profile.place(i));
    curve.value.push_back(profile.average(i).bins() > 0 ? profile.average(i).mean() : NAN);
    curve.half_width.push_back(profile.average(i).half_width());
  }
  curve.value = mirrored(curve.value);
  curve.half_width = mirrored(curve.half_width);
  return curve;
}

double at(const Curve& curve, double place) {
  const auto above = std::ranges::upper_bound(curve.place, place);
  if (above == curve.place.begin()) return curve.value.front();
  if (above == curve.place.end()) return curve.value.back();
  const auto i = static_cast<std::size_t>(above - curve.place.begin());
  const double share = (place - curve.place[i - 1]) / (curve.place[i] - curve.place[i - 1]);
  return (1 - share) * curve.value[i - 1] + share * curve.value[i];
}

std::string profile_table(const std::vector<const ReproducedRun*>& runs, const std::string& monitor) {
  std::string text =
      "| | mean over the width | published source | its mean | root mean square of the differences, place by place "
      "|\n|---|---|---|---|---|\n";
  for (const auto* run : runs) {
    const Curve ours = curve_of(*profile_of(*run, monitor));
    for (const auto& reference : references_of(run->scene, monitor, false)) {
      double sum = 0, theirs = 0, mine = 0;
      for (const auto& point : reference.points()) {
        const double value = at(ours, point.x());
        sum += std::pow(value - point.value(), 2);
        theirs += point.value();
        mine += value;
      }
      const int count = reference.points_size();
      text += "| " + label_of(*run) + " | " + number_text(mine / count) + " | " + reference.source() + " | " +
              number_text(theirs / count) + " | " + number_text(std::sqrt(sum / count)) + " |\n";
    }
  }
  return text;
}

void draw_profiles(const std::filesystem::path& file, const std::vector<const ReproducedRun*>& runs, const std::string& monitor) {
  std::string blocks, draws;
  std::size_t index = 0;
  for (const auto* run : runs) {
    const Curve curve = curve_of(*profile_of(*run, monitor));
    const std::string name = "$run" + std::to_string(index), colour = line_colours[index % line_colours.size()];
    blocks += name + " << EOD\n";
    for (std::size_t i = 0; i < curve.place.size(); ++i)
      blocks += number_text(1e3 * curve.place[i]) + " " + (std::isfinite(curve.value[i]) ? number_text(curve.value[i]) : "NaN") +
                " " + number_text(curve.half_width[i]) + "\n";
    blocks += "EOD\n";
    draws += (draws.empty() ? "" : ", \\\n  ") + name + " using 1:($2-$3):($2+$3) with filledcurves fc rgb \"" + colour +
             "\" fs transparent solid 0.18 notitle, " + name + " using 1:2 with lines lw 2 lc rgb \"" + colour + "\" title " +
             gnuplot_quoted(label_of(*run));
    ++index;
  }
  int symbol = 6;
  for (const auto& reference : references_of(runs.front()->scene, monitor, false)) {
    const std::string name = "$reference" + std::to_string(symbol);
    blocks += name + " << EOD\n";
    for (const auto& point : reference.points()) blocks += number_text(1e3 * point.x()) + " " + number_text(point.value()) + "\n";
    blocks += "EOD\n";
    draws += ", \\\n  " + name + " using 1:2 with points pt " + std::to_string(symbol) +
             " ps 1.2 lw 1.3 lc rgb \"#c0392b\" title " + gnuplot_quoted(reference.source());
    symbol += 2;
  }
  std::string script = picture_head(file, {900, 620}) + blocks;
  const std::string& unit = profile_of(*runs.front(), monitor)->unit();
  script += "set xlabel \"place  /  mm\"\nset ylabel " + gnuplot_quoted(monitor + (unit == "1" ? "" : "  /  " + unit)) +
            "\nset key below center maxrows 4 Left reverse nobox\nplot " + draws + "\nunset output\n";
  draw_picture(script, file);
}

// ------------------------------------------------------------------------------------------------ the page

std::string runs_table(const std::vector<ReproducedRun>& runs) {
  std::string text =
      "| condition | preset | simulated | averaged from | bins | CPU s per simulated s |\n|---|---|---|---|---|---|\n";
  for (const auto& run : runs) {
    const auto averaged = std::ranges::find_if(run.scene.monitors(), [](const auto& monitor) { return monitor.has_averaging(); });
    text += "| " + run.condition + " | " + run.preset + " | " + number_text(run.scene.time().end()) + " s | " +
            number_text(averaged->averaging().start()) + " s | " + std::to_string(averaged->averaging().bins()) + " × " +
            number_text(averaged->averaging().bin()) + " s | " + number_text(std::round(10 * run.cost) / 10) + " |\n";
  }
  return text;
}

std::string condition_text(const std::filesystem::path& folder, const std::vector<const ReproducedRun*>& runs) {
  const auto& scene = runs.front()->scene;
  std::string text = "\n## " + runs.front()->condition + "\n";
  for (const auto& monitor : scene.monitors()) {
    const auto& name = monitor.name();
    const bool is_known = std::ranges::any_of(scene.references(), [&](const auto& one) { return one.monitor() == name; });
    const bool is_averaged = monitor.has_averaging() && (series_of(*runs.front(), name) || profile_of(*runs.front(), name));
    if (!is_averaged) continue;
    const bool is_series = series_of(*runs.front(), name) != nullptr;
    if (!is_known && !is_series) continue;
    text += "\n### " + name + (is_series ? ", " + series_of(*runs.front(), name)->unit() : "") + "\n\n";
    if (is_series) {
      text += "Mean in time:\n\n" + value_table(runs, name, false) + "\nFluctuation in time (standard deviation):\n\n" +
              value_table(runs, name, true);
    } else {
      text += profile_table(runs, name);
    }
    if (!is_known) continue;
    const std::string picture = runs.front()->condition + "_" + name + ".png";
    if (is_series)
      draw_values(folder / picture, runs, name);
    else
      draw_profiles(folder / picture, runs, name);
    text += "\n![" + name + "](" + picture + ")\n";
  }
  return text;
}

}  // namespace

std::filesystem::path write_page(const std::filesystem::path& folder, const std::string& name, const std::string& command,
                                 const std::vector<ReproducedRun>& runs) {
  make_folder(folder);
  std::string text =
      "# " + name + ", reproduced\n\n" + made_by(command) + "\n" + runs_table(runs) +
      "\nTwo values a ± δa and b ± δb agree when (|a − b| − δa − δb) / ((a + b)/2) ≤ 0, the measure of arXiv 1909.02067; "
      "otherwise they are that far apart. Published values without an interval count as exact. Profiles of ours are "
      "averaged with their mirror image.\n";
  std::vector<std::string> conditions;
  for (const auto& run : runs)
    if (std::ranges::find(conditions, run.condition) == conditions.end()) conditions.push_back(run.condition);
  for (const auto& condition : conditions) {
    std::vector<const ReproducedRun*> of_it;
    for (const auto& run : runs)
      if (run.condition == condition) of_it.push_back(&run);
    text += condition_text(folder, of_it);
  }
  auto page = folder / (name + ".md");
  write_text(page, text);
  return page;
}

}  // namespace bedflow::client
