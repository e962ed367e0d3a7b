// Watching: resumed after a dropped stream, patient with a server that is away, detached by Ctrl-C.
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <csignal>
#include <thread>

#include "client_fixture.h"
#include "failure.h"
#include "progress.h"

namespace bedflow::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* job_id = "j-000000000001";

v1::WatchJobResponse state_message(v1::JobState state, std::uint64_t last, v1::StopReason reason = v1::FINISHED) {
  v1::WatchJobResponse message;
  *message.mutable_job() = job_of(job_id, state, reason);
  message.mutable_job()->set_last_sequence(last);
  return message;
}
v1::WatchJobResponse event_message(std::uint64_t sequence) {
  v1::WatchJobResponse message;
  *message.mutable_event() = progress_event(sequence, 0.05 * static_cast<double>(sequence));
  message.set_sequence(sequence);
  return message;
}
WatchScript ended(v1::JobState state, v1::StopReason reason = v1::FINISHED) {
  return {{state_message(state, 0, reason)}, grpc::Status::OK};
}

TEST_F(Client, WatchGoesOnFromItsTokenAfterADroppedStream) {
  service_.watches = {{{state_message(v1::RUNNING, 2), event_message(1), event_message(2)}, {grpc::UNAVAILABLE, "going down"}},
                      {{state_message(v1::RUNNING, 3), event_message(2), event_message(3)}, {grpc::UNAVAILABLE, "again"}},
                      {{state_message(v1::RUNNING, 3), event_message(4), state_message(v1::SUCCEEDED, 4)}, grpc::Status::OK}};
  const auto result = bedflow({"watch", job_id, "--history", "-o", "jsonl"});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_THAT(service_.tokens(), ElementsAre(0, 2, 3));
  for (const char* sequence : {"1", "2", "3", "4"}) {  // each event once, though one was sent twice
    const std::string mark = std::string("{\"sequence\":\"") + sequence + "\"";
    const auto first = result.out.find(mark);
    ASSERT_NE(first, std::string::npos) << result.out;
    EXPECT_EQ(result.out.find(mark, first + 1), std::string::npos) << result.out;
  }
  EXPECT_THAT(result.error, HasSubstr("the job is not touched"));
  EXPECT_THAT(result.error, HasSubstr("connected again"));
}

TEST_F(Client, WatchGivesUpAServerThatStaysAwayInBoundedTime) {
  service_.watches = {{{state_message(v1::RUNNING, 7), event_message(7)}, {grpc::UNAVAILABLE, "gone"}}};
  std::thread away([&] {
    EXPECT_TRUE(service_.wait_for_watchers(1, std::chrono::seconds(20)));
    stop_server();
  });
  const auto result = bedflow({"watch", job_id, "--history", "--away", "0.5"});
  away.join();
  EXPECT_EQ(result.exit_code, static_cast<int>(Exit::unreachable));
  EXPECT_THAT(result.error, HasSubstr("bedflow watch j-000000000001 --after 7"));
}

TEST_F(Client, TheEndOfTheJobIsTheExitCode) {
  const std::vector<std::tuple<v1::JobState, v1::StopReason, Exit>> expected = {
      {v1::SUCCEEDED, v1::FINISHED, Exit::ok},
      {v1::FAILED, v1::DIVERGED, Exit::job_failed},
      {v1::FAILED, v1::CHECKPOINT_CORRUPT, Exit::corrupt},
      {v1::STATE_CANCELLED, v1::CANCELLED, Exit::cancelled},
      {v1::STATE_SUSPENDED, v1::SUSPENDED, Exit::wrong_state}};
  for (const auto& [state, reason, exit] : expected) {
    service_.watches = {ended(state, reason)};
    EXPECT_EQ(bedflow({"watch", job_id}).exit_code, static_cast<int>(exit));
    EXPECT_EQ(bedflow({"wait", job_id}).exit_code, static_cast<int>(exit));
  }
  EXPECT_EQ(bedflow({"wait", job_id, "--for", "suspended"}).exit_code, static_cast<int>(Exit::ok));
}

TEST_F(Client, WaitThatIsTooLongIsExitEight) {
  service_.watches = {{{state_message(v1::RUNNING, 0)}, grpc::Status::OK, true}};
  const auto result = bedflow({"wait", job_id, "--timeout", "0.2"});
  EXPECT_EQ(result.exit_code, static_cast<int>(Exit::timed_out));
  EXPECT_THAT(result.error, HasSubstr("still RUNNING after 0.2 s"));
}

TEST_F(Client, InterruptDetachesAndNeverCancels) {
  service_.watches = {{{state_message(v1::RUNNING, 0)}, grpc::Status::OK, true}};
  const auto log = folder_ / "log";
  const pid_t pid = start_detached({program(), "watch", job_id, "--server", address_}, log);
  ASSERT_TRUE(service_.wait_for_watchers(1, std::chrono::seconds(20)));
  kill(pid, SIGINT);
  int status = 0;
  ASSERT_EQ(waitpid(pid, &status, 0), pid);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), static_cast<int>(Exit::interrupted));
  EXPECT_EQ(service_.cancels, 0);
  EXPECT_THAT(read(log), HasSubstr("come back: bedflow watch j-000000000001 --server " + address_));
}

TEST_F(Client, LogsEndsWithTheNewestEventOfARunningJob) {
  auto warning = event_message(2);
  warning.mutable_event()->mutable_log()->set_severity(v1::LogLine::WARNING);
  warning.mutable_event()->mutable_log()->set_text("a step was cut");
  service_.watches = {{{state_message(v1::RUNNING, 2), event_message(1), warning}, grpc::Status::OK, true}};
  const auto result = bedflow({"logs", job_id});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("warning: a step was cut"));
}

TEST(Progress, LineFitsTheTerminalAndKeepsWhatMattersMost) {
  SpeedGauge speed;
  speed.add(progress_event(1, 0.1).progress());
  const auto progress = progress_event(2, 0.2).progress();
  speed.add(progress);
  EXPECT_NEAR(*speed.simulated_per_wall(), 0.01, 1e-12);  // 0.1 s in 10 wall s
  EXPECT_NEAR(*speed.steps_per_second(), 100, 1e-9);
  const auto wide = progress_line(progress, speed, 120, false);
  for (const char* part : {"40.0 %", "step 2000", "t 0.2000/0.5 s", "0.0100 s/s", "100 steps/s", "ETA 30 s", "[####"}) {
    EXPECT_THAT(wide, HasSubstr(part));
  }
  for (const int width : {20, 40, 60, 80, 120}) {
    EXPECT_LE(display_width(progress_line(progress, speed, width, true)), static_cast<std::size_t>(width));
    EXPECT_THAT(progress_line(progress, speed, width, true), HasSubstr("40.0 %"));
  }
}

TEST(Progress, SpeedForgetsTheAttemptBefore) {
  SpeedGauge speed;
  speed.add(progress_event(1, 0.3).progress());
  speed.add(progress_event(2, 0.1).progress());  // resumed further back
  EXPECT_FALSE(speed.simulated_per_wall());
}

}  // namespace
}  // namespace bedflow::client
