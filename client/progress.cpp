#include "progress.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace bedflow::client {

namespace {

constexpr double speed_window = 15;  // wall s
constexpr std::chrono::milliseconds redraw_interval{100};
constexpr std::chrono::seconds line_interval{10};

double share_done(const v1::Progress& progress) {
  return progress.end_time() > 0 ? std::clamp(progress.time() / progress.end_time(), 0.0, 1.0) : 0;
}

std::string fixed(double value, int digits) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

double eta(const v1::Progress& progress, const SpeedGauge& speed) {
  if (progress.has_eta_seconds()) return progress.eta_seconds();
  const auto rate = speed.simulated_per_wall();
  return rate && *rate > 0 ? (progress.end_time() - progress.time()) / *rate : NAN;
}

}  // namespace

std::string progress_bar(double share, int cells, bool unicode) {
  const auto full = static_cast<int>(share * cells);
  std::string text;
  for (int i = 0; i < cells; ++i) text += i < full ? (unicode ? "█" : "#") : (unicode ? "░" : "-");
  return text;
}

std::string rate_text(double value) {
  if (value <= 0 || value < 1e-4) return number_text(value);
  const int digits = std::clamp(2 - static_cast<int>(std::floor(std::log10(value))), 0, 7);
  return fixed(value, digits);
}

void SpeedGauge::add(const v1::Progress& progress) {
  const Point point = {progress.wall_seconds(), progress.time(), static_cast<double>(progress.step())};
  if (!points_.empty() && (point.wall < points_.back().wall || point.step < points_.back().step))
    points_.clear();  // a new attempt
  if (!points_.empty() && point.wall == points_.back().wall) points_.pop_back();
  points_.push_back(point);
  while (points_.size() > 2 && points_.back().wall - points_[1].wall > speed_window) points_.pop_front();
}

std::optional<double> SpeedGauge::simulated_per_wall() const {
  if (points_.size() < 2) return std::nullopt;
  return (points_.back().time - points_.front().time) / (points_.back().wall - points_.front().wall);
}

std::optional<double> SpeedGauge::steps_per_second() const {
  if (points_.size() < 2) return std::nullopt;
  return (points_.back().step - points_.front().step) / (points_.back().wall - points_.front().wall);
}

std::string progress_line(const v1::Progress& progress, const SpeedGauge& speed, int width, bool unicode) {
  constexpr int widest_bar = 30, narrowest_bar = 8, brackets = 3;
  const double share = share_done(progress), left = eta(progress, speed);
  const std::string gap = width < 100 ? " " : "  ";
  const std::string phase = progress.phase() == "settling" ? "settling " : "";
  std::vector<std::string> parts = {fixed(100 * share, 1) + " %",
                                    phase + "t " + fixed(progress.time(), 4) + "/" + number_text(progress.end_time()) + " s",
                                    "ETA " + (std::isfinite(left) ? duration_text(left) : std::string("?"))};
  if (const auto rate = speed.simulated_per_wall()) parts.push_back(rate_text(*rate) + " s/s");
  parts.push_back("step " + std::to_string(progress.step()));
  if (const auto rate = speed.steps_per_second()) parts.push_back(rate_text(*rate) + " steps/s");
  const int room = width < 60 ? width : width - narrowest_bar - brackets;
  std::string text = parts[0];
  for (std::size_t i = 1; i < parts.size(); ++i) {
    if (display_width(text + gap + parts[i]) > static_cast<std::size_t>(room)) break;
    text += gap + parts[i];
  }
  if (width < 60) return text;
  const int cells = std::min(width - static_cast<int>(display_width(text)) - brackets, widest_bar);
  return "[" + progress_bar(share, cells, unicode) + "] " + text;
}

void ProgressDisplay::update(const v1::Progress& progress) {
  speed_.add(progress);
  newest_ = progress;
  newest_shown_ = false;
  const auto wait =
      terminal_.interactive() ? std::chrono::milliseconds(redraw_interval) : std::chrono::milliseconds(line_interval);
  if (!shown_ || Clock::now() - *shown_ >= wait) draw();
}

void ProgressDisplay::draw() {
  if (!newest_) return;
  if (terminal_.interactive()) {
    std::fputs(("\r\033[K" + progress_line(*newest_, speed_, terminal_.width() - 1, terminal_.unicode())).c_str(), stderr);
    std::fflush(stderr);
    line_open_ = true;
  } else {
    say(progress_line(*newest_, speed_, 110, false));
  }
  shown_ = Clock::now();
  newest_shown_ = true;
}

void ProgressDisplay::message(const std::string& line) {
  const bool redraw = line_open_;
  clear();
  say(line);
  if (redraw) draw();
}

void ProgressDisplay::finish() {
  if (newest_ && !newest_shown_) draw();
  if (line_open_) std::fputs("\n", stderr);
  line_open_ = false;
}

void ProgressDisplay::clear() {
  if (line_open_) std::fputs("\r\033[K", stderr);
  line_open_ = false;
}

}  // namespace bedflow::client
