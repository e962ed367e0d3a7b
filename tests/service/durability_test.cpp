// What is acknowledged is there, once; and a job has one live attempt at most, whatever is killed when.
#include <gmock/gmock.h>
#include <signal.h>

#include <future>
#include <map>
#include <set>
#include <thread>

#include "folder.h"
#include "process.h"
#include "service_fixture.h"
#include "support/trials.h"

namespace bedflow::test {
namespace {

using namespace std::chrono_literals;

class Durability : public ServiceTest {
 protected:
  explicit Durability(std::vector<std::string> arguments = {}) : ServiceTest(std::move(arguments)) {}

  bool was_doubled(const std::string& id) const { return std::filesystem::exists(server_.folder(id) / "doubled"); }

  // `bedflowd run-attempt`, as by hand.
  server::Answer run_attempt(const std::string& id, std::uint32_t epoch) const {
    return server::ask(
        {server_program, "run-attempt", server_.folder(id), std::to_string(epoch), "--engine", BEDFLOW_FAKE_ENGINE}, 30s,
        1 << 20);
  }
  void kill_attempt(const std::string& id) {
    const auto processes = server_.attempt_processes(id);
    for (const pid_t process : processes) ::kill(process, SIGKILL);
    ASSERT_TRUE(holds_within(10s, [&] { return server_.attempt_processes(id).empty(); }));
  }
};

// Submits until the server is killed, which a second thread does at its moment. What was not answered stays to be asked again.
class SubmitLoop {
 public:
  SubmitLoop(ServerProcess& server, v1::CreateJobRequest request) : server_(server), request_(std::move(request)) {}

  void until_killed_after(std::chrono::microseconds delay) {
    auto killer = std::async(std::launch::async, [&, pid = server_.pid()] {
      std::this_thread::sleep_for(delay);  // the moment of the fault, not a wait for something to happen
      ::kill(pid, SIGKILL);
    });
    constexpr int most_a_round = 5;  // the engines have to get through with them too
    for (int i = 0; i < most_a_round && killer.wait_for(0s) != std::future_status::ready; ++i)
      try_one("kill-loop-" + std::to_string(next_++));
    killer.wait();
    server_.kill();  // waits for its end
    server_.start();
    for (const auto& id : std::exchange(unanswered_, {})) try_one(id);
  }
  const std::map<std::string, std::string>& acknowledged() const { return acknowledged_; }  // request -> job
  const std::set<std::string>& unanswered() const { return unanswered_; }

 private:
  void try_one(const std::string& request_id) {
    request_.set_request_id(request_id);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + 20s);
    v1::CreateJobResponse response;
    if (server_.stub().CreateJob(&context, request_, &response).ok()) {
      acknowledged_[request_id] = response.job().id();
    } else {
      unanswered_.insert(request_id);
    }
  }

  ServerProcess& server_;
  v1::CreateJobRequest request_;
  int next_ = 0;
  std::map<std::string, std::string> acknowledged_;
  std::set<std::string> unanswered_;
};

TEST_F(Durability, EveryAcknowledgedJobIsThereOnceAndRunsOnceWhereverTheServerIsKilled) {
  Chance chance;
  SubmitLoop loop(server_, job_of(3));
  const int kills = trials(15, 200);
  for (int i = 0; i < kills; ++i) loop.until_killed_after(std::chrono::microseconds(chance.below(100'000)));
  EXPECT_TRUE(loop.unanswered().empty()) << loop.unanswered().size() << " were refused even when asked again";
  std::set<std::string> acknowledged;
  for (const auto& [request, job] : loop.acknowledged()) acknowledged.insert(job);
  EXPECT_EQ(acknowledged.size(), loop.acknowledged().size()) << "two requests got the same job";
  const auto is_done = [](const v1::Job& job) { return job.state() == v1::SUCCEEDED; };
  ASSERT_TRUE(holds_within(120s, [&] {
    const auto jobs = all_jobs(stub());
    return std::all_of(jobs.begin(), jobs.end(), is_done);
  }));
  const auto jobs = all_jobs(stub());
  EXPECT_EQ(jobs.size(), acknowledged.size());
  for (const auto& job : jobs) {
    EXPECT_EQ(acknowledged.count(job.id()), 1u) << job.id() << " was never acknowledged";
    EXPECT_FALSE(was_doubled(job.id())) << job.id();
    const auto told = watch(stub(), job.id(), 0, [](const auto&) { return false; });
    EXPECT_EQ(std::count_if(told.begin(), told.end(), [](const auto& one) { return one.event().has_stopped(); }), 1) << job.id();
  }
  std::cout << kills << " kills, " << jobs.size() << " jobs\n";
}

TEST_F(Durability, OverManyKillsAWatcherMissesAndDoublesNothing) {
  Chance chance;
  const int kills = trials(4, 20);
  const auto id = submit(job_of(200 * kills, "step_ms=2"));
  std::uint64_t last = 0;
  v1::JobState state{};
  const auto take = [&](const v1::WatchJobResponse& response) {
    if (response.has_job()) state = response.job().state();
    if (!response.has_event()) return;
    EXPECT_EQ(response.event().sequence(), last + response.merged() + 1);
    last = response.event().sequence();
  };
  for (int i = 0; i < kills; ++i) {
    const auto enough = last + 1 + chance.below(100);
    for (const auto& response : watch(stub(), id, last, [&](const auto& one) { return one.sequence() >= enough; }))
      take(response);
    server_.kill();
    server_.start();
  }
  for (const auto& response : watch(stub(), id, last, [](const auto&) { return false; })) take(response);
  EXPECT_EQ(state, v1::SUCCEEDED);
  EXPECT_EQ(last, job(id).last_sequence());
  EXPECT_EQ(job(id).epoch(), 1u);
  EXPECT_FALSE(was_doubled(id));
}

TEST_F(Durability, ASecondRunnerOfAnAttemptIsRefused) {
  const auto id = submit(job_of(1000, "step_ms=5"));
  ASSERT_TRUE(has_reached(id, 5));
  const auto engines = server_.engines(id);
  const auto second = run_attempt(id, 1);
  EXPECT_EQ(second.exit_code, 75);
  EXPECT_THAT(second.error, testing::HasSubstr("is run by another runner"));
  EXPECT_EQ(server_.engines(id), engines);
  EXPECT_FALSE(was_doubled(id));
}

TEST_F(Durability, AnAttemptThatHasDiedIsNotRunAgain) {
  const auto id = submit(job_of(1000, "step_ms=5"));
  ASSERT_TRUE(has_reached(id, 5));
  server_.kill();
  kill_attempt(id);
  const auto again = run_attempt(id, 1);
  EXPECT_EQ(again.exit_code, 75);
  EXPECT_THAT(again.error, testing::HasSubstr("has been run already"));
  std::filesystem::create_directories(server::JobFolder(server_.folder(id)).attempt(7));
  const auto late = run_attempt(id, 6);
  EXPECT_EQ(late.exit_code, 75);
  EXPECT_THAT(late.error, testing::HasSubstr("has been replaced by attempt 7"));
}

TEST_F(Durability, OfTwoRunnersThatStartAtOnceOneRuns) {
  const auto id = submit(job_of(30, "step_ms=1"));
  wait_for(id, v1::SUCCEEDED);
  for (std::uint32_t epoch = 2; epoch < 12; ++epoch) {
    auto other = std::async(std::launch::async, [&] { return run_attempt(id, epoch).exit_code; });
    const int one = run_attempt(id, epoch).exit_code;
    EXPECT_THAT((std::vector{one, other.get()}), testing::UnorderedElementsAre(0, 75));
  }
  EXPECT_FALSE(was_doubled(id));
}

TEST_F(Durability, RetriesWaitLongerAndLongerAndTheJobTellsUntilWhen) {
  auto request = job_of(100, "die_at=5");  // before the first checkpoint
  request.mutable_spec()->mutable_retries()->set_most(2);
  const auto id = submit(request);
  std::vector<double> pauses;
  watch(stub(), id, 0, [&](const v1::WatchJobResponse& response) {
    const v1::Job& job = response.job();
    if (job.state() != v1::RECOVERING) return false;
    EXPECT_EQ(job.retries(), pauses.size() + 1);
    pauses.push_back(1e-9 * static_cast<double>(job.next_attempt_unix_nanos() - job.changed_unix_nanos()));
    return pauses.size() == 2;
  });
  ASSERT_EQ(pauses.size(), 2u);
  EXPECT_NEAR(pauses[0], 0, 0.2);  // the two times are taken one after the other
  EXPECT_NEAR(pauses[1], 2, 0.2);
  // A new server keeps to it.
  const auto due = job(id).next_attempt_unix_nanos();
  server_.kill();
  server_.start();
  EXPECT_EQ(job(id).state(), v1::RECOVERING);
  EXPECT_EQ(job(id).next_attempt_unix_nanos(), due);
  const auto failed = wait_for(id, v1::FAILED);
  EXPECT_EQ(failed.state(), v1::FAILED);
  EXPECT_EQ(failed.epoch(), 3u);
  EXPECT_GT(failed.changed_unix_nanos(), due);
}

TEST_F(Durability, AnAttemptThatCameFurtherHasItsRetriesAnew) {
  auto request = job_of(60, "die_after=15");  // checkpoints every 10 steps: 10 further in each attempt
  request.mutable_spec()->mutable_retries()->set_most(1);
  const auto done = wait_for(submit(request), v1::SUCCEEDED);
  EXPECT_EQ(done.state(), v1::SUCCEEDED);
  EXPECT_EQ(done.epoch(), 6u);
}

TEST_F(Durability, APlanThatKillsItsEngineIsRefusedAndTheNextIsNot) {
  v1::CreateJobResponse response;
  expect_refused(create(job_of(1, "plan=dies"), response), grpc::StatusCode::INTERNAL, "BACKEND_ERROR");
  EXPECT_EQ(wait_for(submit(job_of(1)), v1::SUCCEEDED).state(), v1::SUCCEEDED);
}

}  // namespace
}  // namespace bedflow::test
