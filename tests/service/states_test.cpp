// A job's way through its states on requests, the queue, checkpoints and queries.
#include <gmock/gmock.h>

#include <fstream>

#include "folder.h"
#include "service_fixture.h"

namespace bedflow::test {
namespace {

using grpc::StatusCode;
using testing::HasSubstr;

class States : public ServiceTest {
 protected:
  explicit States(std::vector<std::string> arguments = {}) : ServiceTest(std::move(arguments)) {}
  v1::ListCheckpointsResponse checkpoints(const std::string& id) {
    v1::ListCheckpointsRequest request;
    request.set_id(id);
    v1::ListCheckpointsResponse response;
    EXPECT_TRUE(call(&v1::JobService::Stub::ListCheckpoints, request, response).ok());
    return response;
  }
};

TEST_F(States, AJobRunsToItsEnd) {
  const auto id = submit(job_of(20));
  const auto done = wait_for(id, v1::SUCCEEDED);
  EXPECT_EQ(done.state(), v1::SUCCEEDED);
  EXPECT_EQ(done.reason(), v1::FINISHED);
  EXPECT_EQ(done.epoch(), 1u);
  EXPECT_EQ(done.progress().step(), 20u);
  EXPECT_GT(done.last_sequence(), 20u);
}

TEST_F(States, AJobOfTwoRanksRunsUnderMpirun) {
  auto request = job_of(5);
  request.mutable_spec()->set_ranks(2);
  const auto id = submit(request);
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).state(), v1::SUCCEEDED);
  EXPECT_THAT(server::read_text(server::JobFolder(server_.folder(id)).runner(1)), HasSubstr("mpirun -n 2"));
}

TEST_F(States, SuspendedAndResumedAJobGoesOnWhereItWas) {
  const auto id = submit(job_of(100, "step_ms=5"));
  ASSERT_TRUE(has_reached(id, 15));
  ASSERT_TRUE(suspend(id).ok());
  ASSERT_EQ(wait_for(id, v1::STATE_SUSPENDED).state(), v1::STATE_SUSPENDED);
  const auto step = job(id).progress().step();
  EXPECT_LT(step, 100u);
  ASSERT_TRUE(resume(id).ok());
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).epoch(), 2u);
  std::uint64_t started_at = 0;
  for (const auto& response : watch(stub(), id, 0, [](const auto&) { return false; })) {
    if (response.event().has_started() && response.event().epoch() == 2) started_at = response.event().started().step();
  }
  EXPECT_EQ(started_at, step);
}

TEST_F(States, SuspendAndCancelMayBeAskedTwice) {
  const auto id = submit(job_of(1000, "step_ms=5"));
  wait_for(id, v1::RUNNING);
  EXPECT_TRUE(suspend(id).ok());
  EXPECT_TRUE(suspend(id).ok());
  wait_for(id, v1::STATE_SUSPENDED);
  EXPECT_TRUE(suspend(id).ok());
  EXPECT_TRUE(cancel(id).ok());
  EXPECT_TRUE(cancel(id).ok());
  EXPECT_EQ(job(id).state(), v1::STATE_CANCELLED);
}

TEST_F(States, ACommandThatComesBeforeTheEngineIsObeyed) {
  const auto id = submit(job_of(1000, "step_ms=5"));
  ASSERT_TRUE(holds_within(std::chrono::seconds(10), [&] { return job(id).state() != v1::PENDING; }));
  ASSERT_TRUE(suspend(id).ok());
  EXPECT_EQ(wait_for(id, v1::STATE_SUSPENDED).state(), v1::STATE_SUSPENDED);
}

TEST_F(States, CancelWritesACheckpointUnlessToldOtherwise) {
  auto request = job_of(1000, "step_ms=5");
  request.mutable_spec()->mutable_checkpoints()->set_every_steps(100'000);
  const auto with = submit(request), without = submit(request);
  ASSERT_TRUE(has_reached(with, 3) && has_reached(without, 3));
  ASSERT_TRUE(cancel(with).ok());
  v1::CancelJobRequest skip;
  skip.set_id(without);
  skip.set_skip_checkpoint(true);
  v1::Job answer;
  ASSERT_TRUE(call(&v1::JobService::Stub::CancelJob, skip, answer).ok());
  EXPECT_EQ(answer.state(), v1::CANCELLING);
  EXPECT_EQ(wait_for(with, v1::STATE_CANCELLED).state(), v1::STATE_CANCELLED);
  EXPECT_EQ(wait_for(without, v1::STATE_CANCELLED).state(), v1::STATE_CANCELLED);
  EXPECT_EQ(checkpoints(with).checkpoints_size(), 1);
  EXPECT_EQ(checkpoints(without).checkpoints_size(), 0);
}

TEST_F(States, RequestsThatTheStateDoesNotAllowAreRefusedByName) {
  const auto done = submit(job_of(1));
  wait_for(done, v1::SUCCEEDED);
  expect_refused(cancel(done), StatusCode::FAILED_PRECONDITION, "WRONG_STATE");
  expect_refused(suspend(done), StatusCode::FAILED_PRECONDITION, "WRONG_STATE");
  expect_refused(resume(done), StatusCode::FAILED_PRECONDITION, "WRONG_STATE");
  v1::CreateCheckpointRequest request;
  request.set_id(done);
  v1::Checkpoint checkpoint;
  const auto status = call(&v1::JobService::Stub::CreateCheckpoint, request, checkpoint);
  expect_refused(status, StatusCode::FAILED_PRECONDITION, "WRONG_STATE");
  EXPECT_THAT(status.error_message(), HasSubstr("is SUCCEEDED"));
  const auto running = submit(job_of(1000, "step_ms=5"));
  wait_for(running, v1::RUNNING);
  expect_refused(resume(running), StatusCode::FAILED_PRECONDITION, "WRONG_STATE");
}

TEST_F(States, AFaultOfTheCaseFailsTheJobAtOnce) {
  const auto id = submit(job_of(100, "diverge_at=5"));
  const auto failed = wait_for(id, v1::FAILED);
  EXPECT_EQ(failed.state(), v1::FAILED);
  EXPECT_EQ(failed.reason(), v1::DIVERGED);
  EXPECT_EQ(failed.epoch(), 1u);
}

TEST_F(States, ACheckpointOnDemandIsAnsweredWhenItIsWritten) {
  auto request = job_of(1000, "step_ms=5");
  request.mutable_spec()->mutable_checkpoints()->set_every_steps(100'000);
  const auto id = submit(request);
  wait_for(id, v1::RUNNING);
  v1::CreateCheckpointRequest ask_for;
  ask_for.set_id(id);
  v1::Checkpoint checkpoint;
  const auto status = call(&v1::JobService::Stub::CreateCheckpoint, ask_for, checkpoint);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(std::filesystem::exists(server_.folder(id) / "checkpoints" / checkpoint.file()));
  EXPECT_EQ(checkpoints(id).checkpoints(0).step(), checkpoint.step());
  EXPECT_EQ(checkpoints(id).checkpoints(0).time(), checkpoint.time());
  EXPECT_EQ(job(id).state(), v1::RUNNING);
}

TEST_F(States, ACheckpointThatDoesNotComeIsTimedOut) {
  const auto id = submit(job_of(100, "freeze_at=5"));
  ASSERT_TRUE(has_reached(id, 4));
  v1::CreateCheckpointRequest request;
  request.set_id(id);
  request.set_timeout_seconds(0.1);
  v1::Checkpoint checkpoint;
  expect_refused(call(&v1::JobService::Stub::CreateCheckpoint, request, checkpoint), StatusCode::DEADLINE_EXCEEDED, "TIMED_OUT");
}

TEST_F(States, StatisticsAreAnsweredWhileTheJobRunsAndAfter) {
  const auto id = submit(job_of(60, "step_ms=5"));
  ASSERT_TRUE(has_reached(id, 10));
  v1::QueryStatisticsRequest request;
  request.set_id(id);
  v1::Statistics running, done;
  ASSERT_TRUE(call(&v1::JobService::Stub::QueryStatistics, request, running).ok());
  ASSERT_EQ(running.series_size(), 1);
  EXPECT_GE(running.series(0).value_size(), 10);
  wait_for(id, v1::SUCCEEDED);
  ASSERT_TRUE(call(&v1::JobService::Stub::QueryStatistics, request, done).ok());
  EXPECT_EQ(done.series(0).value_size(), 60);
  request.add_names("no_such_monitor");
  v1::Statistics none;
  expect_refused(call(&v1::JobService::Stub::QueryStatistics, request, none), StatusCode::NOT_FOUND, "SERIES_NOT_FOUND");
}

TEST_F(States, ASnapshotComesFromTheNewestGoodCheckpoint) {
  const auto id = submit(job_of(25));
  wait_for(id, v1::SUCCEEDED);
  v1::GetSnapshotRequest request;
  request.set_id(id);
  v1::Snapshot snapshot;
  ASSERT_TRUE(call(&v1::JobService::Stub::GetSnapshot, request, snapshot).ok());
  EXPECT_EQ(snapshot.step(), 25u);
  const server::JobFolder folder(server_.folder(id));
  std::ofstream(folder.checkpoint(25)) << "torn";
  ASSERT_TRUE(call(&v1::JobService::Stub::GetSnapshot, request, snapshot).ok());
  EXPECT_EQ(snapshot.step(), 20u);
  request.set_step(25);
  expect_refused(call(&v1::JobService::Stub::GetSnapshot, request, snapshot), StatusCode::DATA_LOSS, "CHECKPOINT_CORRUPT");
  request.set_step(7);
  expect_refused(call(&v1::JobService::Stub::GetSnapshot, request, snapshot), StatusCode::NOT_FOUND, "CHECKPOINT_NOT_FOUND");
}

TEST_F(States, AJobStartsFromAnyJobsCheckpointWithItsCaseOrAnother) {
  const auto source = submit(job_of(20));
  wait_for(source, v1::SUCCEEDED);
  v1::CreateJobRequest same;
  same.mutable_start_from()->set_job(source);
  same.mutable_start_from()->set_step(10);
  auto longer = job_of(30);
  longer.mutable_start_from()->set_job(source);
  const auto first = submit(same), second = submit(longer);
  EXPECT_EQ(wait_for(first, v1::SUCCEEDED).progress().step(), 20u);
  const auto done = wait_for(second, v1::SUCCEEDED);
  EXPECT_EQ(done.progress().step(), 30u);
  EXPECT_EQ(done.start_from_job(), source);
  EXPECT_EQ(done.start_from_step(), 20u);
  same.mutable_start_from()->set_step(11);
  v1::CreateJobResponse response;
  expect_refused(create(same, response), StatusCode::NOT_FOUND, "CHECKPOINT_NOT_FOUND");
}

TEST_F(States, ResumingAnEarlierCheckpointLeavesTheLaterHistory) {
  const auto id = submit(job_of(40, "step_ms=2 diverge_at=35 epoch=1"));
  wait_for(id, v1::FAILED);
  v1::ResumeJobRequest request;
  request.set_id(id);
  request.set_step(10);
  v1::Job resumed;
  ASSERT_TRUE(call(&v1::JobService::Stub::ResumeJob, request, resumed).ok());
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).epoch(), 2u);
  std::uint64_t started_at = 0;
  for (const auto& response : watch(stub(), id, 0, [](const auto&) { return false; })) {
    if (response.event().has_started()) started_at = response.event().started().step();
  }
  EXPECT_EQ(started_at, 10u);
}

class TwoSlots : public States {
 protected:
  TwoSlots() : States({"--slots", "2"}) {}
};

TEST_F(TwoSlots, TheOldestJobStartsWhenItsRanksFit) {
  auto two = job_of(1000, "step_ms=5");
  two.mutable_spec()->set_ranks(2);
  const auto first = submit(two);
  const auto second = submit(job_of(5));
  wait_for(first, v1::RUNNING);
  EXPECT_EQ(job(second).state(), v1::PENDING);
  v1::ServerInfo info;
  ASSERT_TRUE(call(&v1::JobService::Stub::GetServerInfo, v1::GetServerInfoRequest(), info).ok());
  EXPECT_EQ(info.ranks_in_use(), 2u);
  EXPECT_EQ(info.jobs_pending(), 1u);
  ASSERT_TRUE(cancel(first).ok());
  EXPECT_EQ(wait_for(second, v1::SUCCEEDED).state(), v1::SUCCEEDED);
}

TEST_F(TwoSlots, AJobThatCouldNeverStartIsRefused) {
  auto request = job_of(1);
  request.mutable_spec()->set_ranks(3);
  v1::CreateJobResponse response;
  const auto status = create(request, response);
  expect_refused(status, StatusCode::INVALID_ARGUMENT, "INVALID_CASE");
  EXPECT_EQ(detail_of(status).faults(0).path(), "spec.ranks");
}

TEST_F(TwoSlots, AWaitingJobIsSuspendedAndCancelledWithoutHavingRun) {
  auto two = job_of(1000, "step_ms=5");
  two.mutable_spec()->set_ranks(2);
  const auto first = submit(two);
  wait_for(first, v1::RUNNING);
  const auto second = submit(job_of(5));
  ASSERT_TRUE(suspend(second).ok());
  EXPECT_EQ(job(second).state(), v1::STATE_SUSPENDED);
  ASSERT_TRUE(resume(second).ok());
  EXPECT_EQ(job(second).state(), v1::PENDING);
  ASSERT_TRUE(cancel(second).ok());
  EXPECT_EQ(job(second).state(), v1::STATE_CANCELLED);
  EXPECT_EQ(job(second).epoch(), 0u);
}

}  // namespace
}  // namespace bedflow::test
