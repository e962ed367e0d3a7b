// Who starts when: priorities, slots, memory by the plans, wall limits; and what is told to those that wait.
#include <gmock/gmock.h>

#include "folder.h"
#include "process.h"
#include "queue.h"
#include "service_fixture.h"

namespace bedflow::test {
namespace {

using grpc::StatusCode;
using testing::AllOf;
using testing::HasSubstr;

// ---------------------------------------------------------------------------------------------- the queue by itself

class Line : public testing::Test {
 protected:
  void put(const std::string& id, int priority, std::uint32_t ranks, double mib = 0, const std::string& executor = "local") {
    server::JobRecord record;
    record.number = ++numbers_;
    record.job.set_id(id);
    record.job.set_state(v1::PENDING);
    record.job.set_created_unix_nanos(numbers_);
    record.job.mutable_spec()->set_priority(priority);
    record.job.mutable_spec()->set_ranks(ranks);
    record.job.mutable_spec()->set_executor(executor);
    record.job.set_planned_memory_bytes(static_cast<std::uint64_t>(mib * (1 << 20)));
    queue.put(record);
  }
  std::string next(std::uint32_t ranks_in_use = 0, double mib_in_use = 0) {
    return queue.next({{"local", {ranks_in_use, 1, mib_in_use * (1 << 20)}}}).value_or("none");
  }
  server::Queue queue{{{"local", {4, 4, 1000.0 * (1 << 20)}}, {"slurm", {0, 64, 0}}}};
  std::int64_t numbers_ = 0;
};

TEST_F(Line, TheHighestPriorityIsFirstAmongEqualsTheOldest) {
  put("a", 0, 1), put("b", 5, 1), put("c", 5, 1), put("d", -5, 1);
  EXPECT_THAT(queue.first(10), testing::ElementsAre("b", "c", "a", "d"));
  EXPECT_EQ(next(), "b");
  queue.take("b");
  EXPECT_EQ(next(), "c");
}

TEST_F(Line, NobodyOvertakesTheFirstOfALineButOtherLinesGoOn) {
  put("large", 0, 4), put("small", 0, 1), put("far", 0, 32, 0, "slurm");
  EXPECT_EQ(next(1), "far");
  queue.take("far");
  EXPECT_EQ(next(1), "none");
  EXPECT_EQ(next(0), "large");
}

TEST_F(Line, WhatIsLackingIsTold) {
  put("a", 0, 3, 900), put("b", 0, 1);
  const std::map<std::string, server::Use> uses = {{"local", {2, 1, 200.0 * (1 << 20)}}};
  EXPECT_EQ(queue.reason("a", uses), "3 of 4 slots (2 are free) and 900 MiB of memory (800 MiB of 1.0 GiB are free)");
  EXPECT_EQ(queue.reason("b", uses), "its turn after a, which waits for " + queue.reason("a", uses));
  EXPECT_EQ(queue.reason("a", {}), "");
  EXPECT_EQ(queue.reason("b", uses, [](const std::string&) { return true; }), "") << "one ahead that is held is not waited for";
}

TEST_F(Line, OneWhosePauseIsNotOverIsPassed) {
  server::JobRecord record;
  record.job.set_id("later");
  record.job.set_state(v1::RECOVERING);
  const auto now = std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
  record.job.set_next_attempt_unix_nanos(now + 20'000'000'000);
  queue.put(record);
  put("a", 0, 1);
  EXPECT_EQ(next(), "a");
  EXPECT_THAT(queue.reason("later", {}), HasSubstr("the next attempt, in "));
  record.job.set_next_attempt_unix_nanos(now + 3'600'000'000'000);  // the clock was set back
  queue.put(record);
  EXPECT_EQ(next(), "later");
}

// ---------------------------------------------------------------------------------------------------- on a server

class Waiting : public ServiceTest {
 protected:
  Waiting() : ServiceTest({"--slots", "2", "--memory-mib", "1000"}) {}

  v1::CreateJobRequest with(v1::CreateJobRequest request, std::uint32_t ranks, int priority = 0) {
    request.mutable_spec()->set_ranks(ranks);
    request.mutable_spec()->set_priority(priority);
    return request;
  }
  std::string run_until_cancelled(std::uint32_t ranks, const std::string& asks = "") {
    auto id = submit(with(job_of(100'000, "step_ms=5 " + asks), ranks));
    wait_for(id, v1::RUNNING);
    return id;
  }
  std::int64_t started_at(const std::string& id) {
    for (const auto& response : watch(stub(), id, 0, [](const auto&) { return false; })) {
      if (response.event().has_started()) return response.event().unix_nanos();
    }
    return 0;
  }
  v1::ServerInfo info() {
    v1::ServerInfo info;
    EXPECT_TRUE(call(&v1::JobService::Stub::GetServerInfo, v1::GetServerInfoRequest(), info).ok());
    return info;
  }
};

TEST_F(Waiting, TheUrgentOneStartsFirst) {
  const auto running = run_until_cancelled(2);
  const auto calm = submit(with(job_of(3), 2)), urgent = submit(with(job_of(3), 2, 10));
  ASSERT_TRUE(cancel(running).ok());
  ASSERT_EQ(wait_for(calm, v1::SUCCEEDED).state(), v1::SUCCEEDED);
  ASSERT_EQ(wait_for(urgent, v1::SUCCEEDED).state(), v1::SUCCEEDED);
  EXPECT_LT(started_at(urgent), started_at(calm));
}

TEST_F(Waiting, OrderAndPrioritiesOutliveTheServer) {
  const auto running = run_until_cancelled(2);
  const auto calm = submit(with(job_of(3), 2)), urgent = submit(with(job_of(3), 2, 10));
  server_.kill();
  server_.start();
  ASSERT_EQ(info().queue_size(), 2);
  EXPECT_EQ(info().queue(0).id(), urgent);
  EXPECT_EQ(info().queue(1).id(), calm);
  ASSERT_TRUE(cancel(running).ok());
  ASSERT_EQ(wait_for(calm, v1::SUCCEEDED).state(), v1::SUCCEEDED);
  EXPECT_LT(started_at(urgent), started_at(calm));
}

TEST_F(Waiting, TheClientIsToldWhatForInEveryAnswerAndWhileItWatches) {
  const auto running = run_until_cancelled(1);
  const auto first = submit(with(job_of(3), 2)), second = submit(with(job_of(3), 1));
  EXPECT_EQ(job(first).waits_for(), "2 of 2 slots (1 is free)");
  EXPECT_EQ(job(second).waits_for(), "its turn after " + first + ", which waits for 2 of 2 slots (1 is free)");
  EXPECT_EQ(info().queue(0).waits_for(), job(first).waits_for());
  const auto info_now = info();
  ASSERT_EQ(info_now.executor_infos_size(), 1);
  EXPECT_EQ(info_now.executor_infos(0).ranks_in_use(), 1u);
  EXPECT_EQ(info_now.executor_infos(0).jobs_pending(), 2u);
  auto told = watch(stub(), second, 0, [](const auto& one) { return one.has_job(); });
  EXPECT_THAT(told.back().job().waits_for(), HasSubstr(first));
  ASSERT_TRUE(cancel(first).ok());  // now the second has its turn, and runs to its end beside the other
  EXPECT_EQ(wait_for(second, v1::SUCCEEDED).waits_for(), "");
}

TEST_F(Waiting, AWatcherHearsWhenTheReasonChanges) {
  const auto running = run_until_cancelled(1);
  const auto first = submit(with(job_of(3), 2)), second = submit(with(job_of(3), 2));
  std::vector<std::string> reasons;
  watch(stub(), second, 0, [&](const auto& one) {
    if (one.has_job()) reasons.push_back(one.job().waits_for());
    if (reasons.size() == 1) {
      EXPECT_TRUE(cancel(first).ok());
    }
    return reasons.size() >= 2 && reasons.back() == "2 of 2 slots (1 is free)";
  });
  EXPECT_THAT(reasons.front(), HasSubstr("its turn after " + first));
  EXPECT_EQ(reasons.back(), "2 of 2 slots (1 is free)");
}

TEST_F(Waiting, OneThatDoesNotFitIntoTheMemoryNowWaitsAndThenRuns) {
  const auto running = run_until_cancelled(1, "memory_mib=700");
  const auto second = submit(job_of(3, "memory_mib=600"));
  EXPECT_EQ(job(second).state(), v1::PENDING);
  EXPECT_EQ(job(second).waits_for(), "600 MiB of memory (300 MiB of 1.0 GiB are free)");
  EXPECT_EQ(info().executor_infos(0).memory_in_use(), 700ull << 20);
  server_.kill();
  server_.start();
  EXPECT_EQ(job(second).waits_for(), "600 MiB of memory (300 MiB of 1.0 GiB are free)");
  ASSERT_TRUE(cancel(running).ok());
  EXPECT_EQ(wait_for(second, v1::SUCCEEDED).state(), v1::SUCCEEDED);
}

TEST_F(Waiting, OneThatCanNeverFitIntoTheMemoryIsRefusedWithTheNumbers) {
  v1::CreateJobResponse response;
  const auto status = create(job_of(3, "memory_mib=1100"), response);
  expect_refused(status, StatusCode::INVALID_ARGUMENT, "INVALID_CASE");
  EXPECT_EQ(detail_of(status).faults(0).path(), "memory");
  EXPECT_THAT(detail_of(status).faults(0).text(), AllOf(HasSubstr("needs 1.1 GiB"), HasSubstr("may have 1.0 GiB")));
  EXPECT_TRUE(create(job_of(3, "memory_mib=1000"), response).ok());
}

TEST_F(Waiting, AnExecutorThatTheServerDoesNotHaveIsRefused) {
  auto request = job_of(3);
  request.mutable_spec()->set_executor("slurm");
  v1::CreateJobResponse response;
  const auto status = create(request, response);
  expect_refused(status, StatusCode::INVALID_ARGUMENT, "INVALID_CASE");
  EXPECT_EQ(detail_of(status).faults(0).path(), "spec.executor");
  EXPECT_THAT(detail_of(status).faults(0).text(), HasSubstr("this server has: local"));
}

TEST_F(Waiting, AResumedJobTakesOtherRanksPriorityAndWallLimitAndIsCheckedAgain) {
  const auto id = run_until_cancelled(1);
  ASSERT_TRUE(suspend(id).ok());
  wait_for(id, v1::STATE_SUSPENDED);
  v1::ResumeJobRequest request;
  request.set_id(id);
  request.set_ranks(3);
  v1::Job answer;
  auto status = call(&v1::JobService::Stub::ResumeJob, request, answer);
  expect_refused(status, StatusCode::INVALID_ARGUMENT, "INVALID_CASE");
  EXPECT_EQ(detail_of(status).faults(0).path(), "spec.ranks");
  request.set_ranks(2);
  request.set_priority(7);
  request.set_wall_limit_seconds(3600);
  ASSERT_TRUE(call(&v1::JobService::Stub::ResumeJob, request, answer).ok());
  EXPECT_EQ(answer.spec().ranks(), 2u);
  EXPECT_EQ(answer.spec().priority(), 7);
  EXPECT_EQ(answer.spec().wall_limit_seconds(), 3600);
}

// ------------------------------------------------------------------------------------------------------ wall limit

TEST_F(Waiting, AtItsWallLimitAJobEndsByName) {
  const auto id = run_until_cancelled(1);
  ::kill(server_.runner(id), SIGUSR1);  // as a batch system does when the time is nearly over
  const auto failed = wait_for(id, v1::FAILED);
  EXPECT_EQ(failed.state(), v1::FAILED);
  EXPECT_EQ(failed.reason(), v1::WALL_LIMIT);
  EXPECT_EQ(failed.epoch(), 1u);
  EXPECT_FALSE(server::JobFolder(server_.folder(id)).checkpoint_steps().empty());
  EXPECT_TRUE(resume(id).ok());
}

TEST_F(Waiting, OrGoesOnWhenItsTurnComesAgainBehindThoseThatWait) {
  auto request = with(job_of(100'000, "step_ms=5"), 2);
  request.mutable_spec()->set_at_wall_limit(v1::JobSpec::REQUEUE);
  const auto id = submit(request);
  ASSERT_TRUE(has_reached(id, 12));
  const auto other = submit(with(job_of(3), 2));
  ::kill(server_.runner(id), SIGUSR1);
  EXPECT_EQ(wait_for(other, v1::SUCCEEDED).state(), v1::SUCCEEDED);
  ASSERT_TRUE(holds_within(std::chrono::seconds(20), [&] { return job(id).epoch() == 2 && job(id).state() == v1::RUNNING; }));
  EXPECT_EQ(job(id).retries(), 0u);
  std::uint64_t resumed_at = 0;
  watch(stub(), id, 0, [&](const auto& one) {
    if (one.event().has_started() && one.event().epoch() == 2) resumed_at = one.event().started().step();
    return resumed_at > 0;
  });
  EXPECT_GE(resumed_at, 12u);
}

// ------------------------------------------------------------------------------------------------- around the edges

TEST_F(Waiting, ARetriedSubmissionOfADeletedJobDoesNotRunItAgain) {
  auto request = job_of(3);
  request.set_request_id("only-once-please");
  const auto id = submit(request);
  wait_for(id, v1::SUCCEEDED);
  v1::DeleteJobRequest remove;
  remove.set_id(id);
  v1::DeleteJobResponse removed;
  ASSERT_TRUE(call(&v1::JobService::Stub::DeleteJob, remove, removed).ok());
  server_.kill();
  server_.start();
  v1::CreateJobResponse response;
  const auto status = create(request, response);
  expect_refused(status, StatusCode::ALREADY_EXISTS, "JOB_DELETED");
  EXPECT_THAT(status.error_message(), AllOf(HasSubstr(id), HasSubstr("30 days")));
  v1::ListJobsResponse list;
  ASSERT_TRUE(call(&v1::JobService::Stub::ListJobs, v1::ListJobsRequest(), list).ok());
  EXPECT_EQ(list.jobs_size(), 0);
}

TEST_F(Waiting, AJobWhoseFolderSomebodyRemovesFailsByThatNameAndIsNotBegunAnew) {
  const auto id = run_until_cancelled(1);
  std::filesystem::rename(server_.folder(id), folder_.path() / "elsewhere");
  v1::Runner runner;
  ASSERT_TRUE(server::read_message(folder_.path() / "elsewhere/attempts/1/runner.txtpb", runner));
  for (const pid_t process : server::session_members(static_cast<pid_t>(runner.pid()))) ::kill(process, SIGKILL);
  const auto failed = wait_for(id, v1::FAILED);
  EXPECT_EQ(failed.reason(), v1::FOLDER_REMOVED);
  EXPECT_FALSE(std::filesystem::exists(server_.folder(id)));
}

TEST_F(Waiting, TheClientShowsQueueAndReasons) {
  const auto running = run_until_cancelled(2);
  const auto client = [&](std::vector<std::string> words) {
    words.insert(words.begin(), BEDFLOW_BIN_DIR "/bedflow");
    words.insert(words.end(), {"--server", server_.address()});
    return server::ask(words, std::chrono::seconds(30), 1 << 20);
  };
  const auto id = submit(with(job_of(3), 2, 4));
  EXPECT_THAT(
      client({"server", "info"}).output,
      AllOf(HasSubstr("2 of 2 slots in use"), HasSubstr(id + " fake, 2 ranks, priority 4; waits for 2 of 2 slots (0 are free)")));
  EXPECT_THAT(client({"get", id}).output,
              AllOf(HasSubstr("waits for"), HasSubstr("2 of 2 slots (0 are free)"), HasSubstr("priority")));
  EXPECT_THAT(client({"resume", id, "--wall-limit", "soon"}).error,
              HasSubstr("soon is no time; say e.g. 90 (seconds), 30min, 2h"));
}

}  // namespace
}  // namespace bedflow::test
