#include "step_controller.h"

#include <algorithm>

#include "base/short_number.h"

namespace bedflow {

namespace {

constexpr double less = 0.9;             // a cut, and the inverse of a growth
constexpr int steps_before_growth = 10;  // converged ones
constexpr double same = 1e-9;            // of a step: times nearer than that are one

}  // namespace

StepController::StepController(const Plan& plan)
    : longest_(plan.longest_step), shortest_(plan.shortest_step), size_(plan.step), corners_(plan.corners) {}

void StepController::restore(double size, int good_steps) {
  size_ = std::min(size, longest_);
  good_steps_ = good_steps;
}

std::string StepController::shorten(double to, double time, const std::string& reason) {
  if (to < shortest_) {
    throw Stop(Reason::not_converged, "the gas needs a step below time.shortest_step = " + short_number(shortest_) +
                                          " s at t = " + short_number(time) + " s, where dt is " + short_number(size_) +
                                          " s: " + reason);
  }
  std::string note = "dt cut from " + short_number(size_) + " to " + short_number(to) + " s: " + reason;
  size_ = to;
  good_steps_ = 0;
  return note;
}

std::string StepController::hold(const StepLimit& limit, double time) {
  limit_ = limit.longest;
  double allowed = size_;
  while (allowed > limit_ && allowed >= shortest_) allowed *= less;
  return allowed < size_ ? shorten(allowed, time, limit.reason) : "";
}

std::string StepController::cut(double& dt, double time, const std::string& reason) {
  size_ = dt;
  std::string note = shorten(less * dt, time, reason);
  dt = size_;
  return note;
}

std::string StepController::converged() {
  if (size_ >= longest_ || ++good_steps_ < steps_before_growth) return {};
  const double grown = std::min(longest_, size_ / less);
  if (grown > limit_) return {};
  size_ = grown;
  good_steps_ = 0;
  return "dt grows to " + short_number(size_) + " s: " + std::to_string(steps_before_growth) + " steps have converged";
}

double StepController::corner_after(double time) const {
  const auto corner = std::upper_bound(corners_.begin(), corners_.end(), time + same * size_);
  return corner != corners_.end() ? *corner : corners_.back();
}

double StepController::next(double time) const {
  const double left = corner_after(time) - time;
  if (left <= (1 + same) * size_) return left;
  return left < 2 * size_ ? 0.5 * left : size_;
}

double StepController::end(double time, double dt) const {
  const double corner = corner_after(time), end = time + dt;
  return std::abs(end - corner) <= same * size_ ? corner : end;
}

}  // namespace bedflow
