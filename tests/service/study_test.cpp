// Studies on the real server and the real engine: they survive the server, run nothing twice, stop what has said enough, and say
// what a user can work out from the jobs themselves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "case_file.h"
#include "real_engine_fixture.h"

namespace bedflow::test {
namespace {

class RealStudy : public RealEngine {
 protected:
  // Of small beds that differ in their sub-steps.
  static v1::CreateStudyRequest request(const std::vector<int>& steps, double end) {
    v1::CreateStudyRequest asked;
    asked.set_request_id("a-study-of-mine");
    auto& spec = *asked.mutable_spec();
    spec.set_name("steps");
    spec.add_axes("steps_per_collision");
    auto base = bed(1, end);
    base.mutable_case_()->mutable_particles()->mutable_random()->set_velocity_deviation(0.05);
    auto& averaging = *base.mutable_case_()->mutable_monitors(0)->mutable_averaging();
    averaging.set_start(0.2 * end);
    averaging.set_bin(0.1 * end);
    averaging.set_bins(8);
    *spec.mutable_job() = base.spec();
    for (const int step : steps) {
      auto& point = *spec.add_points();
      point.add_values(std::to_string(step));
      *point.mutable_case_() = base.case_();
      point.mutable_case_()->mutable_particles()->set_steps_per_collision(step);
    }
    spec.set_reference(0);
    spec.add_quantities()->set_monitor("kinetic_energy");
    return asked;
  }
  v1::Study create(const v1::CreateStudyRequest& asked) {
    grpc::ClientContext context;
    v1::Study study;
    const auto status = stub().CreateStudy(&context, asked, &study);
    EXPECT_TRUE(status.ok()) << status.error_message() << detail_of(status).DebugString();
    return study;
  }
  v1::Study get(const std::string& id) {
    grpc::ClientContext context;
    v1::GetStudyRequest asked;
    asked.set_id(id);
    v1::Study study;
    const auto status = stub().GetStudy(&context, asked, &study);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return study;
  }
  v1::Study wait_for_end(const std::string& id) {
    v1::Study study;
    EXPECT_TRUE(holds_within(limit, [&] { return (study = get(id)).state() != v1::STUDY_RUNNING; }));
    return study;
  }
  std::vector<v1::Job> jobs() {
    grpc::ClientContext context;
    v1::ListJobsResponse all;
    EXPECT_TRUE(stub().ListJobs(&context, v1::ListJobsRequest(), &all).ok());
    return {all.jobs().begin(), all.jobs().end()};
  }
};

TEST_F(RealStudy, SurvivesTheServerAndRunsNothingTwice) {
  const auto asked = request({40, 20, 10}, 0.02);
  const auto id = create(asked).id();
  // Killed when its first job is there, and again when a run has ended.
  ASSERT_TRUE(holds_within(limit, [&] { return !jobs().empty(); }));
  server_.kill();
  server_.start();
  EXPECT_EQ(create(asked).id(), id);  // the retry of a client that has lost the answer
  ASSERT_TRUE(holds_within(limit, [&] { return get(id).runs(0).state() == v1::SUCCEEDED; }));
  server_.kill();
  server_.start();
  const auto study = wait_for_end(id);
  EXPECT_EQ(study.state(), v1::STUDY_DONE) << study.message();
  EXPECT_EQ(jobs().size(), 4u);  // a packing and three runs
  std::set<std::string> used;
  for (const auto& run : study.runs()) {
    EXPECT_EQ(run.state(), v1::SUCCEEDED) << run.message();
    EXPECT_GT(run.cost().cpu_seconds(), 0);
    EXPECT_GT(run.cost().phases_size(), 5);
    used.insert(run.job());
    // What the study says of a run is what the run's own statistics say.
    const auto own = statistics(run.job());
    ASSERT_EQ(run.quantities_size(), 1);
    EXPECT_EQ(run.quantities(0).mean(), own.series(0).average().mean());
    EXPECT_EQ(run.quantities(0).bins(), 8u);
    EXPECT_EQ(run.errors(0).value(), run.quantities(0).mean() - study.runs(0).quantities(0).mean());
  }
  EXPECT_EQ(used.size(), 3u);
  EXPECT_EQ(study.runs(0).errors(0).value(), 0);
  EXPECT_NE(study.runs(2).errors(0).value(), 0);  // another step, another path
  // All have begun with the same particles: their first sample is of the same bits.
  const double first = statistics(study.runs(0).job()).series(0).value(0);
  EXPECT_GT(first, 0);
  for (const auto& run : study.runs()) EXPECT_EQ(statistics(run.job()).series(0).value(0), first);

  // Half of another study is done already.
  auto more = request({40, 20, 12}, 0.02);
  more.set_request_id("another-study");
  const auto second = wait_for_end(create(more).id());
  EXPECT_EQ(second.packing_job(), study.packing_job());
  EXPECT_EQ(second.runs(0).job(), study.runs(0).job());
  EXPECT_TRUE(second.runs(1).reused());
  EXPECT_FALSE(second.runs(2).reused());
  EXPECT_EQ(jobs().size(), 5u);
}

// The reference's particles are no start for others: fewer, wider, or elsewhere.
TEST_F(RealStudy, RunsWithOtherParticlesSeedTheirOwn) {
  auto asked = request({20, 20, 20, 10}, 0.004);
  auto& points = *asked.mutable_spec()->mutable_points();
  auto& fewer = *points[1].mutable_case_()->mutable_particles();
  const auto count = fewer.random().count();
  fewer.mutable_random()->set_count(count / 2);
  points[2].mutable_case_()->mutable_particles()->mutable_coarse_graining()->set_factor(1.25);
  for (auto& point : points) {
    auto& monitor = *point.mutable_case_()->add_monitors();
    monitor.set_name("count");
    monitor.mutable_particle_count();
    monitor.set_interval(0);
  }
  const auto study = wait_for_end(create(asked).id());
  ASSERT_EQ(study.state(), v1::STUDY_DONE) << study.message();
  const auto counted = [&](int run) {
    const auto own = statistics(study.runs(run).job());
    const auto found = std::ranges::find(own.series(), "count", &v1::Series::name);
    return found == own.series().end() ? -1 : found->value(0);
  };
  EXPECT_EQ(counted(0), count);
  EXPECT_EQ(counted(1), count / 2);
  EXPECT_NEAR(counted(2), count, 0.5 * std::pow(1.25, 3));  // whole parcels
  EXPECT_EQ(counted(3), count);
  std::map<std::string, std::string> packed_by;
  for (const auto& job : jobs()) packed_by[job.id()] = job.start_from_job();
  EXPECT_EQ(packed_by[study.runs(0).job()], study.packing_job());
  EXPECT_EQ(packed_by[study.runs(1).job()], "");
  EXPECT_EQ(packed_by[study.runs(2).job()], "");
  EXPECT_EQ(packed_by[study.runs(3).job()], study.packing_job());
}

TEST_F(RealStudy, StopsARunWhoseIntervalIsNarrowEnough) {
  auto asked = request({20, 10}, 100);  // hours, if nobody stops them
  for (auto& point : *asked.mutable_spec()->mutable_points()) {
    auto& averaging = *point.mutable_case_()->mutable_monitors(0)->mutable_averaging();
    averaging.set_start(0);
    averaging.set_bin(0.002);
    averaging.set_bins(10000);
  }
  asked.mutable_spec()->mutable_stop()->set_relative(1);
  asked.mutable_spec()->mutable_stop()->set_bins(3);
  const auto study = wait_for_end(create(asked).id());
  EXPECT_EQ(study.state(), v1::STUDY_DONE) << study.message();
  for (const auto& run : study.runs()) {
    EXPECT_TRUE(run.interval_met());
    EXPECT_EQ(run.state(), v1::STATE_SUSPENDED);  // it can be taken up again
    EXPECT_GE(run.quantities(0).bins(), 3u);
    EXPECT_LE(run.quantities(0).half_width(), run.quantities(0).mean());
    EXPECT_GT(run.cost().cpu_seconds(), 0);
  }
}

TEST_F(RealStudy, IsRefusedWithWhatIsWrongAndCancelledWithItsJobs) {
  const auto refused = [&](const v1::CreateStudyRequest& asked) {
    grpc::ClientContext context;
    v1::Study study;
    const auto status = stub().CreateStudy(&context, asked, &study);
    EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
    return status.error_message() + " " + detail_of(status).DebugString();
  };
  auto asked = request({20, 10}, 100);
  asked.mutable_spec()->mutable_quantities(0)->set_monitor("humidity");
  EXPECT_THAT(refused(asked), testing::HasSubstr("humidity"));
  asked = request({20, 10}, 100);
  asked.mutable_spec()->mutable_points(1)->mutable_case_()->mutable_particles()->set_steps_per_collision(2);
  EXPECT_THAT(refused(asked), testing::AllOf(testing::HasSubstr("point 1 (10)"), testing::HasSubstr("steps_per_collision")));
  asked = request({20}, 100);
  asked.mutable_spec()->set_reference(7);
  EXPECT_THAT(refused(asked),
              testing::AllOf(testing::HasSubstr("allowed are 2 to 1000"), testing::HasSubstr("is 7, but there are 1")));
  EXPECT_TRUE(jobs().empty());

  const auto id = create(request({20, 10}, 100)).id();
  ASSERT_TRUE(holds_within(limit, [&] { return get(id).runs(1).has_job(); }));
  grpc::ClientContext context;
  v1::CancelStudyRequest cancel;
  cancel.set_id(id);
  v1::Study study;
  ASSERT_TRUE(stub().CancelStudy(&context, cancel, &study).ok());
  study = get(id);
  for (const auto& run : study.runs()) EXPECT_EQ(wait_for(run.job(), v1::STATE_CANCELLED).state(), v1::STATE_CANCELLED);
  grpc::ClientContext another;
  v1::DeleteStudyRequest deletion;
  deletion.set_id(id);
  deletion.set_with_jobs(true);
  v1::DeleteStudyResponse freed;
  ASSERT_TRUE(stub().DeleteStudy(&another, deletion, &freed).ok());
  EXPECT_TRUE(jobs().empty());
}

}  // namespace
}  // namespace bedflow::test
