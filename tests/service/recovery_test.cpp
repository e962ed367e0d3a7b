// What is killed, and what is not lost.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <fstream>

#include "folder.h"
#include "process.h"
#include "service_fixture.h"

namespace bedflow::test {
namespace {

class Recovery : public ServiceTest {
 protected:
  explicit Recovery(std::vector<std::string> arguments = {}) : ServiceTest(std::move(arguments)) {}

  std::vector<std::uint64_t> sequences(const std::vector<v1::WatchJobResponse>& told) {
    std::vector<std::uint64_t> found;
    for (const auto& response : told) {
      if (response.has_event()) found.push_back(response.event().sequence());
    }
    return found;
  }
  std::vector<v1::WatchJobResponse> history(const std::string& id, std::uint64_t after = 0) {
    return watch(stub(), id, after, [](const auto&) { return false; });
  }
  // Steps at which the job's attempts have started.
  std::vector<std::uint64_t> starts(const std::string& id) {
    std::vector<std::uint64_t> found;
    for (const auto& response : history(id)) {
      if (response.event().has_started()) found.push_back(response.event().started().step());
    }
    return found;
  }
  std::vector<std::uint64_t> one_to(std::uint64_t last) {
    std::vector<std::uint64_t> numbers(last);
    for (std::uint64_t i = 0; i < last; ++i) numbers[i] = i + 1;
    return numbers;
  }
};

TEST_F(Recovery, AKilledServersJobRunsOnAndAWatcherMissesAndDoublesNothing) {
  const auto id = submit(job_of(120, "step_ms=5"));
  auto told = watch(stub(), id, 0, [](const auto& response) { return response.sequence() >= 20; });
  server_.kill();
  const auto engines = server_.engines(id);
  ASSERT_EQ(engines.size(), 1u);
  server_.start();
  EXPECT_EQ(job(id).state(), v1::RUNNING);
  EXPECT_EQ(server_.engines(id), engines);  // the same process
  const auto rest = history(id, told.back().sequence());
  told.insert(told.end(), rest.begin(), rest.end());
  EXPECT_EQ(told.back().job().state(), v1::SUCCEEDED);
  EXPECT_EQ(told.back().job().epoch(), 1u);
  EXPECT_EQ(sequences(told), one_to(told.back().job().last_sequence()));
}

TEST_F(Recovery, AJobThatEndsWhileNoServerIsThereIsTakenUpAsEnded) {
  const auto id = submit(job_of(60, "step_ms=5"));
  wait_for(id, v1::RUNNING);
  server_.kill();
  ASSERT_TRUE(holds_within(std::chrono::seconds(20), [&] { return server_.attempt_processes(id).empty(); }));
  server_.start();
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).state(), v1::SUCCEEDED);
  EXPECT_EQ(job(id).epoch(), 1u);
}

TEST_F(Recovery, AKilledEngineIsStartedAgainFromTheNewestCheckpoint) {
  const auto id = submit(job_of(100, "step_ms=5"));
  ASSERT_TRUE(has_reached(id, 25));
  for (const pid_t engine : server_.engines(id)) ::kill(engine, SIGKILL);
  bool recovered = false;
  const auto told = watch(stub(), id, 0, [&](const auto& response) {
    recovered = recovered || response.job().state() == v1::RECOVERING;
    return response.job().state() == v1::SUCCEEDED;
  });
  EXPECT_TRUE(recovered);
  EXPECT_EQ(told.back().job().epoch(), 2u);
  EXPECT_EQ(sequences(told), one_to(told.back().job().last_sequence()));
  ASSERT_EQ(starts(id).size(), 2u);
  EXPECT_GE(starts(id)[1], 20u);
  EXPECT_EQ(starts(id)[1] % 10, 0u);  // checkpoints are written every 10 steps
}

TEST_F(Recovery, ATornCheckpointIsPassedOver) {
  const auto id = submit(job_of(100, "step_ms=5 die_at=25 epoch=1"));
  ASSERT_TRUE(has_reached(id, 12));
  // A newer one that is no good, as a crash of the machine might leave it.
  std::ofstream(server::JobFolder(server_.folder(id)).checkpoint(24)) << "torn";
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).state(), v1::SUCCEEDED);
  EXPECT_THAT(starts(id), testing::ElementsAre(0, 20));
}

TEST_F(Recovery, ARankKilledUnderMpirunIsRecovered) {
  auto request = job_of(60, "step_ms=5 die_at=25 epoch=1");
  request.mutable_spec()->set_ranks(2);
  const auto id = submit(request);
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).epoch(), 2u);
  EXPECT_THAT(starts(id), testing::ElementsAre(0, 20));
}

TEST_F(Recovery, AKilledRunnerDoesNotTouchItsEngine) {
  const auto id = submit(job_of(100, "step_ms=5"));
  ASSERT_TRUE(has_reached(id, 15));
  const auto engines = server_.engines(id);
  ::kill(server_.runner(id), SIGKILL);
  ASSERT_TRUE(has_reached(id, 30));
  EXPECT_EQ(server_.engines(id), engines);
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).epoch(), 1u);
}

TEST_F(Recovery, RunnerAndEngineKilledAtOnceTheJobIsRecovered) {
  const auto id = submit(job_of(100, "step_ms=5"));
  ASSERT_TRUE(has_reached(id, 25));
  for (const pid_t process : server_.attempt_processes(id)) ::kill(process, SIGKILL);
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).epoch(), 2u);
  EXPECT_GE(starts(id).at(1), 20u);
}

TEST_F(Recovery, EverythingKilledTheNextServerRecoversTheJob) {
  const auto id = submit(job_of(100, "step_ms=5"));
  ASSERT_TRUE(has_reached(id, 25));
  const auto attempt = server_.attempt_processes(id);
  server_.kill();
  for (const pid_t process : attempt) ::kill(process, SIGKILL);
  server_.start();
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).epoch(), 2u);
  EXPECT_GE(starts(id).at(1), 20u);
}

TEST_F(Recovery, RetriesEndWhereTheSpecificationSaysSo) {
  auto request = job_of(100, "die_at=15");
  request.mutable_spec()->mutable_retries()->set_most(1);
  const auto failed = wait_for(submit(request), v1::FAILED);
  EXPECT_EQ(failed.state(), v1::FAILED);
  EXPECT_EQ(failed.reason(), v1::RANK_DIED);
  EXPECT_EQ(failed.epoch(), 2u);
}

TEST_F(Recovery, AFailedJobCanBeResumedByItsUser) {
  auto request = job_of(40, "die_at=15 epoch=1");
  request.mutable_spec()->mutable_retries()->set_most(0);
  const auto id = submit(request);
  ASSERT_EQ(wait_for(id, v1::FAILED).reason(), v1::RANK_DIED);
  ASSERT_TRUE(resume(id).ok());
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).state(), v1::SUCCEEDED);
  EXPECT_THAT(starts(id), testing::ElementsAre(0, 10));
}

TEST_F(Recovery, CancellingAJobWhoseEngineDiesIsCancelled) {
  const auto id = submit(job_of(1000, "step_ms=5"));
  wait_for(id, v1::RUNNING);
  const auto engines = server_.engines(id);
  for (const pid_t engine : engines) ::kill(engine, SIGSTOP);  // it cannot obey
  ASSERT_TRUE(cancel(id).ok());
  EXPECT_EQ(job(id).state(), v1::CANCELLING);
  for (const pid_t engine : engines) ::kill(engine, SIGKILL);
  EXPECT_EQ(wait_for(id, v1::STATE_CANCELLED).state(), v1::STATE_CANCELLED);
}

TEST_F(Recovery, ANewServerDoesNotStartWhatStillRuns) {
  const auto id = submit(job_of(1000, "step_ms=5"));
  wait_for(id, v1::RUNNING);
  for (int i = 0; i < 5; ++i) {
    server_.kill();
    server_.start();
  }
  EXPECT_EQ(server_.engines(id).size(), 1u);
  EXPECT_EQ(server::JobFolder(server_.folder(id)).epochs(), std::vector<std::uint32_t>{1});
}

TEST_F(Recovery, AnEndedServerLeavesWhatRuns) {
  const auto id = submit(job_of(1000, "step_ms=5"));
  wait_for(id, v1::RUNNING);
  const auto engines = server_.engines(id);
  ASSERT_EQ(engines.size(), 1u);
  EXPECT_EQ(server_.stop(), 0);
  EXPECT_EQ(server_.engines(id), engines);
  server_.start();
  EXPECT_EQ(job(id).state(), v1::RUNNING);
  EXPECT_EQ(server_.engines(id), engines);
}

class MissingEngine : public testing::Test {};

TEST_F(MissingEngine, IsABackendErrorOfTheCall) {
  const TemporaryFolder folder;
  ServerProcess server(server_program, folder.path() / "data", "/nonexistent/bedflow-engine");
  grpc::ClientContext context;
  v1::CreateJobResponse response;
  const auto status = server.stub().CreateJob(&context, job_of(1), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INTERNAL);
  EXPECT_THAT(status.error_message(), testing::HasSubstr("/nonexistent/bedflow-engine"));
}

class ShortHeartbeat : public Recovery {
 protected:
  ShortHeartbeat() : Recovery({"--heartbeat-seconds", "1"}) {}
};

TEST_F(ShortHeartbeat, AFrozenEngineIsKilledAndStartedAgain) {
  const auto id = submit(job_of(40, "step_ms=2 freeze_at=25 epoch=1"));
  v1::StopReason why{};
  const auto told = watch(stub(), id, 0, [&](const auto& response) {
    if (response.job().state() == v1::RECOVERING) why = response.job().reason();
    return response.job().state() == v1::SUCCEEDED;
  });
  EXPECT_EQ(why, v1::HEARTBEAT_LOST);
  EXPECT_THAT(starts(id), testing::ElementsAre(0, 20));
}

}  // namespace
}  // namespace bedflow::test
