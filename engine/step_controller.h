// How long the next gas step is.
//
// It is cut by a tenth where the gas does not converge and where the Courant number or the drag of the particles asks for less;
// it grows by a ninth after ten converged steps, where these allow it, up to the longest. A step ends on the corners of what runs
// in time, and on the end: it is shortened for that, and the one before it too, rather than leave a sliver.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "plan.h"

namespace bedflow {

// What a state allows, s, and why, for people.
struct StepLimit {
  double longest = std::numeric_limits<double>::infinity();
  std::string reason;
};

class StepController {
 public:
  explicit StepController(const Plan& plan);

  // Each returns what it changed and why; empty: nothing. hold and cut throw Stop(not_converged) below the shortest step.
  std::string hold(const StepLimit& limit, double time);                // before every step
  std::string cut(double& dt, double time, const std::string& reason);  // it did not converge
  std::string converged();                                              // it did

  double size() const { return size_; }  // s
  int good_steps() const { return good_steps_; }
  void restore(double size, int good_steps);

  double next(double time) const;            // length of the step from a time, s
  double end(double time, double dt) const;  // of the step: on the corner, if it was meant to end there

 private:
  std::string shorten(double to, double time, const std::string& reason);
  double corner_after(double time) const;

  double longest_, shortest_, size_;
  double limit_ = std::numeric_limits<double>::infinity();  // of the present step
  int good_steps_ = 0;                                      // since the size changed
  std::vector<double> corners_;                             // in order; the last is the end
};

}  // namespace bedflow
