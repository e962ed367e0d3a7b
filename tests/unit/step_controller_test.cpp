// The length of the gas step: corners, cuts and growth.
#include "step_controller.h"

#include <gtest/gtest.h>

namespace bedflow {
namespace {

Plan plan(double step, double longest, std::vector<double> corners) {
  Plan result;
  result.step = step;
  result.longest_step = longest;
  result.shortest_step = step / 100;
  result.corners = std::move(corners);
  return result;
}

TEST(StepController, EndsStepsOnEveryCornerAndLeavesNoSliver) {
  const std::vector<double> corners{0.25, 0.3, 0.70001, 1};
  const StepController controller(plan(0.1, 0.1, corners));
  std::vector<double> ends;
  double time = 0, shortest = 1;
  for (int n = 0; n < 30 && time < 1; ++n) {
    const double dt = controller.next(time);
    EXPECT_LE(dt, 0.1 * (1 + 1e-8));
    shortest = std::min(shortest, dt);
    time = controller.end(time, dt);
    ends.push_back(time);
  }
  for (const double corner : corners) EXPECT_EQ(std::count(ends.begin(), ends.end(), corner), 1) << corner;
  EXPECT_EQ(ends.size(), 12U);  // 3, 1, 5 (the last two share 0.10001 s) and 3 steps
  EXPECT_GT(shortest, 0.049);
}

TEST(StepController, CutsByATenthAndGrowsAgainAfterTenSteps) {
  StepController controller(plan(1, 1, {1000}));
  double dt = 1;
  EXPECT_NE(controller.cut(dt, 0, "it oscillates").find("dt cut from 1 to 0.9 s: it oscillates"), std::string::npos);
  EXPECT_EQ(dt, 0.9);
  for (int n = 0; n < 9; ++n) EXPECT_EQ(controller.converged(), "");
  EXPECT_EQ(controller.converged(), "dt grows to 1 s: 10 steps have converged");
  for (int n = 0; n < 20; ++n) EXPECT_EQ(controller.converged(), "");
  EXPECT_EQ(controller.size(), 1);
}

TEST(StepController, GrowsToTheLongestAsLimitsAllow) {
  StepController controller(plan(1, 3, {1000}));
  for (int n = 0; n < 100; ++n) {
    EXPECT_EQ(controller.hold({1.5, "fast"}, 0), "");
    controller.converged();
  }
  EXPECT_LE(controller.size(), 1.5);
  EXPECT_GT(controller.size(), 1.5 * 0.9);
  for (int n = 0; n < 200; ++n) {
    controller.hold({}, 0);
    controller.converged();
  }
  EXPECT_EQ(controller.size(), 3);
  EXPECT_NE(controller.hold({1.5, "fast"}, 0).find("fast"), std::string::npos);
  EXPECT_LE(controller.size(), 1.5);
  EXPECT_GT(controller.size(), 1.5 * 0.9);
}

TEST(StepController, StopsBelowTheShortestStepAndSaysWhy) {
  StepController controller(plan(1, 1, {1000}));
  try {
    controller.hold({1e-3, "the spout is too fast"}, 7);
    FAIL();
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::not_converged);
    EXPECT_NE(std::string(stop.what()).find("time.shortest_step = 0.01 s at t = 7 s"), std::string::npos) << stop.what();
    EXPECT_NE(std::string(stop.what()).find("the spout is too fast"), std::string::npos) << stop.what();
  }
}

// What a checkpoint holds decides all that follows.
TEST(StepController, GoesOnFromItsSizeAndItsGoodSteps) {
  StepController through(plan(1, 3, {1000})), resumed(plan(1, 3, {1000}));
  for (int n = 0; n < 25; ++n) through.converged();
  resumed.restore(through.size(), through.good_steps());
  for (int n = 0; n < 50; ++n) {
    EXPECT_EQ(through.converged(), resumed.converged());
    EXPECT_EQ(through.next(12.3), resumed.next(12.3));
  }
}

}  // namespace
}  // namespace bedflow
