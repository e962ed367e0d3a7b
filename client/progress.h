// The live view of a running job on stderr: a bar on a terminal, a line every ten seconds otherwise.
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>

#include "bedflow/v1/job.pb.h"
#include "terminal.h"

namespace bedflow::client {

// Speed over the last seconds of wall time, so that it follows the bed and does not jump.
class SpeedGauge {
 public:
  void add(const v1::Progress& progress);
  std::optional<double> simulated_per_wall() const;  // simulated s per wall s; none before two points
  std::optional<double> steps_per_second() const;

 private:
  struct Point {
    double wall, time, step;
  };
  std::deque<Point> points_;
};

// "[#####-----] 43.2 %  t 0.2160/0.5 s  ETA 12 s  0.0123 s/s  step 12345  ..." in at most `width` columns; what matters least is
// left out first.
std::string progress_line(const v1::Progress& progress, const SpeedGauge& speed, int width, bool unicode);

std::string progress_bar(double share, int cells, bool unicode);
// Three significant digits; never the form 1e-05 that nobody reads at a glance, down to 0.0001.
std::string rate_text(double value);

class ProgressDisplay {
 public:
  using Clock = std::chrono::steady_clock;

  ProgressDisplay() : terminal_(stderr) {}
  ~ProgressDisplay() { clear(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  void update(const v1::Progress& progress);
  void message(const std::string& line);  // a line that stays, above the bar
  void finish();                          // leaves the last state of the bar, or prints its line
  void clear();
  const Terminal& terminal() const { return terminal_; }

 private:
  void draw();

  Terminal terminal_;
  SpeedGauge speed_;
  std::optional<v1::Progress> newest_;
  std::optional<Clock::time_point> shown_;
  bool line_open_ = false;
  bool newest_shown_ = false;
};

}  // namespace bedflow::client
