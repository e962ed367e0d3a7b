#include "render.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include "failure.h"
#include "gnuplot.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

// Perceptually even, readable in grey and by the colour-blind.
constexpr const char* speed_palette =
    "(0 '#352a87', 0.15 '#0f5cdd', 0.3 '#1481d6', 0.45 '#06a4ca', 0.6 '#2eb7a4', 0.75 '#87bf77', 0.88 '#d1bb59', 1 '#f9fb0e')";
constexpr const char* gas_palette = "(0 '#08306b', 0.25 '#2171b5', 0.5 '#6baed6', 0.75 '#c6dbef', 1 '#ffffff')";

// Pixels of the page. Both maps have the same size and scale.
struct Page {
  double scale;  // pixels a metre
  int map_width, map_height;
  static constexpr int left = 90, right = 40, gap = 90, top = 96, bottom = 150;

  int width(int maps) const { return left + maps * map_width + (maps - 1) * gap + right; }
  int height() const { return top + map_height + bottom; }
};

Page page_of(const v1::Lengths& size) {
  constexpr double tallest = 1000, widest = 760, narrowest = 230;
  double scale = std::min(tallest / size.y(), widest / size.x());
  scale = std::max(scale, std::min(narrowest / size.x(), 1800 / size.y()));  // a slender bed may be a taller picture
  return {scale, static_cast<int>(size.x() * scale), static_cast<int>(size.y() * scale)};
}

class Drawing {
 public:
  Drawing(const v1::Snapshot& snapshot, int maps)
      : snapshot_(snapshot), page_(page_of(snapshot.size())), width_(page_.width(maps)), height_(page_.height()) {}

  PictureSize size() const { return {width_, height_}; }

  // Places the next map on the page, with its colour bar below.
  std::string next_map(const std::string& title, const std::string& bar_label, const char* palette, bool heights) {
    const double left = Page::left + shown_ * (page_.map_width + Page::gap);
    ++shown_;
    const double x0 = left / width_, x1 = (left + page_.map_width) / width_;
    const double y0 = static_cast<double>(Page::bottom) / height_,
                 y1 = (Page::bottom + page_.map_height) / static_cast<double>(height_);
    const double bar = std::max(page_.map_width, 200);
    const double bar_left = left + 0.5 * (page_.map_width - bar);
    std::string text = "set lmargin at screen " + number_text(x0) + "\nset rmargin at screen " + number_text(x1) +
                       "\nset bmargin at screen " + number_text(y0) + "\nset tmargin at screen " + number_text(y1) + "\n";
    text += "set title " + gnuplot_quoted(title) + " font \",14\" offset 0,-0.3\n";
    text += "set palette defined " + std::string(palette) + "\n";
    text += "set colorbox horizontal user origin " + number_text(bar_left / width_) + "," + number_text(62.0 / height_) +
            " size " + number_text(bar / width_) + "," + number_text(16.0 / height_) + " border 9\n";
    text += "set cblabel " + gnuplot_quoted(bar_label) + " offset 0,0.4\n";
    text += std::string("set ylabel ") + (heights ? "\"height  /  mm\"" : "\"\"") + "\n";
    return text;
  }

  // Far particles first, so that near ones lie over them.
  std::string particles() const {
    const auto count = static_cast<std::size_t>(snapshot_.speed_size());
    const bool sized = snapshot_.diameters_size() == snapshot_.speed_size();
    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    const auto& position = snapshot_.position();
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return position[3 * a + 2] > position[3 * b + 2]; });
    std::string rows;
    for (const int i : order) {
      rows += number_text(1e3 * position[3 * i]) + " " + number_text(1e3 * position[3 * i + 1]) + " " +
              number_text(snapshot_.speed(i)) + " " + number_text(500 * (sized ? snapshot_.diameters(i) : snapshot_.diameter())) +
              "\n";  // radius, mm
    }
    return rows;
  }

  // Low end 0; the high end leaves out the fastest two in a thousand, which would take the colours from all others.
  double highest_speed() const {
    std::vector<float> speed(snapshot_.speed().begin(), snapshot_.speed().end());
    if (speed.empty()) return 1;
    const auto at = speed.begin() + static_cast<std::ptrdiff_t>(0.998 * static_cast<double>(speed.size() - 1));
    std::nth_element(speed.begin(), at, speed.end());
    return *at > 0 ? *at : 1;
  }

  std::string gas() const {
    const auto& cells = snapshot_.cells();
    const double dx = 1e3 * snapshot_.size().x() / cells.x(), dy = 1e3 * snapshot_.size().y() / cells.y();
    std::string rows;
    int index = 0;
    for (std::uint32_t j = 0; j < cells.y(); ++j) {
      for (std::uint32_t i = 0; i < cells.x(); ++i) {
        rows += number_text((i + 0.5) * dx) + " " + number_text((j + 0.5) * dy) + " " +
                number_text(snapshot_.gas_fraction(index++)) + "\n";
      }
    }
    return rows;
  }

  // With a thin rim that tells neighbours of one colour apart, as long as a circle has pixels enough for it.
  std::string circles(double speed_scale) const {
    const double pixels = snapshot_.diameter() * page_.scale;
    const std::string rim = pixels >= 5 ? "border lc rgb \"#303030\"" : "noborder";
    return "plot $particles using 1:2:4:($3*" + number_text(speed_scale) +
           ") with circles fillcolor palette lw 0.35 fillstyle solid 1.0 " + rim + " notitle\n";
  }

 private:
  const v1::Snapshot& snapshot_;
  Page page_;
  int width_, height_;
  int shown_ = 0;
};

// The unit in which the highest speed (m/s) is a number short enough for the colour bar, and how many of it a m/s is.
std::pair<const char*, double> speed_unit(double highest) {
  if (highest >= 0.1) return {"m/s", 1};
  if (highest >= 1e-4) return {"mm/s", 1e3};
  return {"µm/s", 1e6};
}

}  // namespace

std::string render_script(const v1::Snapshot& snapshot, const std::string& job, const std::filesystem::path& file) {
  const bool particles = snapshot.speed_size() > 0 && snapshot.position_size() == 3 * snapshot.speed_size();
  const auto& cells = snapshot.cells();
  const bool gas = snapshot.gas_fraction_size() > 0 &&
                   std::uint64_t{cells.x()} * cells.y() == static_cast<std::uint64_t>(snapshot.gas_fraction_size());
  const bool sized = snapshot.size().x() > 0 && snapshot.size().y() > 0;
  if (!sized || (!particles && !gas))
    throw Failure(Exit::other, "the checkpoint of " + job + " has neither particles nor gas to draw");
  Drawing drawing(snapshot, particles + gas);
  std::string text = picture_head(file, drawing.size());
  text += "set multiplot title " + gnuplot_quoted(job + "    t = " + number_text(snapshot.time()) + " s") + " font \",16\"\n";
  text += "set style line 9 lw 0.8 lc rgb \"#444444\"\nset border 15 lw 1 lc rgb \"#444444\"\nunset grid\nunset key\n";
  text += "set xrange [0:" + number_text(1e3 * snapshot.size().x()) +
          "]\nset yrange [0:" + number_text(1e3 * snapshot.size().y()) + "]\n";
  text += "set xlabel \"width  /  mm\"\nset xtics autofreq\nset cbtics out scale 0.4\n";
  if (particles) {
    text += "$particles << EOD\n" + drawing.particles() + "EOD\n";
    const double highest = drawing.highest_speed();
    const auto [label, scale] = speed_unit(highest);
    text += drawing.next_map("particles", std::string("speed  /  ") + label, speed_palette, true);
    text += "set cbrange [0:" + number_text(scale * highest) + "]\n" + drawing.circles(scale);
  }
  if (gas) {
    text += "$gas << EOD\n" + drawing.gas() + "EOD\n";
    text += drawing.next_map("gas, mean over the depth", "gas fraction ε", gas_palette, !particles);
    text += "set cbrange [0.35:1]\nset cbtics 0.1\nplot $gas using 1:2:3 with image notitle\n";
  }
  return text + "unset multiplot\nunset output\n";
}

}  // namespace bedflow::client
