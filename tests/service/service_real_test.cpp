// The promises of the service on bedflow-engine itself.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <span>

#include "real_engine_fixture.h"
#include "support/trials.h"

namespace bedflow::test {
namespace {

TEST_F(RealEngine, RunsAJobOnTwoRanksToItsEnd) {
  const auto id = submit(bed(2, 0.01));
  const auto done = wait_for(id, v1::SUCCEEDED);
  EXPECT_EQ(done.state(), v1::SUCCEEDED) << done.message() << logs(id);
  EXPECT_NEAR(done.progress().time(), 0.01, 2e-4);  // a step may reach beyond the end
  EXPECT_GE(statistics(id).series(0).value_size(), 15);
}

TEST_F(RealEngine, PlansWithoutRunning) {
  auto request = bed(1, 0.01);
  request.set_validate_only(true);
  grpc::ClientContext context;
  v1::CreateJobResponse response;
  const auto status = stub().CreateJob(&context, request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.plan().particles(), 500u);
  EXPECT_GT(response.plan().collision_time(), 0);
}

TEST_F(RealEngine, RunsOnWhenTheServerIsKilledAndNoEventIsMissedOrDoubled) {
  const auto id = submit(bed(2, 0.03));
  auto told = watch_to_checkpoint(id);
  server_.kill();
  const auto before = server_.engines(id);
  server_.start();
  EXPECT_EQ(server_.engines(id), before);
  const auto rest = watch(
      stub(), id, told.back().sequence(), [](const auto&) { return false; }, limit);
  told.insert(told.end(), rest.begin(), rest.end());
  EXPECT_EQ(told.back().job().state(), v1::SUCCEEDED) << told.back().job().message() << logs(id);
  EXPECT_EQ(told.back().job().epoch(), 1u);
  std::uint64_t expected = 0;
  for (const auto& response : told) {
    if (!response.has_event()) continue;
    ASSERT_EQ(response.event().sequence(), ++expected);
  }
}

TEST_F(RealEngine, KilledItIsResumedFromItsCheckpointWithTheSameBits) {
  const auto undisturbed = submit(bed(2, 0.02));
  ASSERT_EQ(wait_for(undisturbed, v1::SUCCEEDED).state(), v1::SUCCEEDED) << logs(undisturbed);
  const auto id = submit(bed(2, 0.02));
  watch_to_checkpoint(id);
  const auto engines = server_.engines(id);
  ASSERT_FALSE(engines.empty());
  ::kill(engines.front(), SIGKILL);
  const auto done = wait_for(id, v1::SUCCEEDED);
  EXPECT_EQ(done.state(), v1::SUCCEEDED) << done.message() << logs(id);
  EXPECT_EQ(done.epoch(), 2u);
  EXPECT_EQ(statistics(id).series(0).SerializeAsString(), statistics(undisturbed).series(0).SerializeAsString());
}

TEST_F(RealEngine, SuspendedOnTwoRanksItResumesOnOne) {
  const auto id = submit(bed(2, 0.02));
  watch_to_checkpoint(id);
  grpc::ClientContext suspend_context, resume_context;
  v1::SuspendJobRequest suspend;
  suspend.set_id(id);
  v1::Job answer;
  ASSERT_TRUE(stub().SuspendJob(&suspend_context, suspend, &answer).ok());
  ASSERT_EQ(wait_for(id, v1::STATE_SUSPENDED).state(), v1::STATE_SUSPENDED) << logs(id);
  v1::ResumeJobRequest resume;
  resume.set_id(id);
  resume.set_ranks(1);
  ASSERT_TRUE(stub().ResumeJob(&resume_context, resume, &answer).ok());
  const auto done = wait_for(id, v1::SUCCEEDED);
  EXPECT_EQ(done.state(), v1::SUCCEEDED) << done.message() << logs(id);
  EXPECT_EQ(done.spec().ranks(), 1u);
}

TEST_F(RealEngine, GivesCheckpointAndSnapshotWhileItRuns) {
  const auto id = submit(bed(2, 0.05));
  wait_for(id, v1::RUNNING);
  grpc::ClientContext checkpoint_context, snapshot_context;
  v1::CreateCheckpointRequest request;
  request.set_id(id);
  v1::Checkpoint checkpoint;
  const auto status = stub().CreateCheckpoint(&checkpoint_context, request, &checkpoint);
  ASSERT_TRUE(status.ok()) << status.error_message() << logs(id);
  v1::GetSnapshotRequest snapshot_request;
  snapshot_request.set_id(id);
  v1::Snapshot snapshot;
  ASSERT_TRUE(stub().GetSnapshot(&snapshot_context, snapshot_request, &snapshot).ok());
  EXPECT_GE(snapshot.step(), checkpoint.step());
  EXPECT_EQ(snapshot.position_size(), 3 * 500);
  EXPECT_EQ(snapshot.gas_fraction_size(), 8 * 16);
  grpc::ClientContext cancel_context;
  v1::CancelJobRequest cancel;
  cancel.set_id(id);
  cancel.set_skip_checkpoint(true);
  v1::Job answer;
  ASSERT_TRUE(stub().CancelJob(&cancel_context, cancel, &answer).ok());
  EXPECT_EQ(wait_for(id, v1::STATE_CANCELLED).state(), v1::STATE_CANCELLED);
}

TEST_F(RealEngine, PassesOverABitFlippedCheckpoint) {
  const auto id = submit(bed(1, 0.02));
  ASSERT_EQ(wait_for(id, v1::SUCCEEDED).state(), v1::SUCCEEDED) << logs(id);
  const server::JobFolder folder(server_.folder(id));
  const auto steps = folder.checkpoint_steps();
  ASSERT_GE(steps.size(), 2u);
  std::string bytes = server::read_text(folder.checkpoint(steps[0]));
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  server::write_durably(folder.checkpoint(steps[0]), bytes);
  v1::GetSnapshotRequest request;
  request.set_id(id);
  v1::Snapshot snapshot;
  {
    grpc::ClientContext context;
    ASSERT_TRUE(stub().GetSnapshot(&context, request, &snapshot).ok());
    EXPECT_EQ(snapshot.step(), steps[1]);
  }
  grpc::ClientContext context;
  request.set_step(steps[0]);
  EXPECT_EQ(stub().GetSnapshot(&context, request, &snapshot).error_code(), grpc::StatusCode::DATA_LOSS);
}

class RealFaults : public RealEngine {
 protected:
  RealFaults() : RealEngine({"--heartbeat-seconds", "5"}) {}

  std::vector<pid_t> ranks(const std::string& id) {
    auto found = server_.engines(id);
    std::sort(found.begin(), found.end());  // rank 0 was started first
    return found;
  }
  pid_t mpirun(const std::string& id) {
    for (const pid_t process : server_.attempt_processes(id)) {
      if (server::command_line(process).starts_with("mpirun")) return process;
    }
    return 0;
  }
};

// One job, and each time it has come to a new checkpoint another fault.
TEST_F(RealFaults, AJobThatMeetsThemAllEndsWithTheBitsOfOneThatMetNone) {
  const double long_enough = 0.1 * trials(2, 4);  // simulated s: the ranks outlive a killed mpirun by a second or two
  const auto undisturbed = submit(bed(2, long_enough));
  ASSERT_EQ(wait_for(undisturbed, v1::SUCCEEDED).state(), v1::SUCCEEDED) << logs(undisturbed);
  const auto id = submit(bed(2, long_enough));
  struct Fault {
    const char* what;
    int signal;
    v1::StopReason found;
  };
  std::uint64_t last = 0, step = 0;
  std::uint32_t epoch = 0;
  const std::vector<Fault> faults = {{"mpirun", SIGKILL, v1::RANK_DIED},
                                     {"rank 1", SIGSTOP, v1::HEARTBEAT_LOST},
                                     {"rank 1", SIGKILL, v1::RANK_DIED},
                                     {"rank 0", SIGSTOP, v1::HEARTBEAT_LOST}};
  for (const auto& [what, signal, found] : std::span(faults).first(static_cast<std::size_t>(trials(2, 4)))) {
    ++epoch;
    const auto to_checkpoint = watch(
        stub(), id, last, [&](const auto& one) { return one.event().epoch() == epoch && one.event().checkpoint().step() > step; },
        limit);
    ASSERT_TRUE(to_checkpoint.back().event().has_checkpoint()) << what << "\n" << logs(id);
    last = to_checkpoint.back().sequence();
    step = to_checkpoint.back().event().checkpoint().step();
    const auto of = ranks(id);
    ASSERT_EQ(of.size(), 2u);
    ::kill(what == std::string("mpirun") ? mpirun(id) : of[what == std::string("rank 1")], signal);
    const auto recovering = wait_for(id, v1::RECOVERING);
    EXPECT_EQ(recovering.state(), v1::RECOVERING) << what;
    EXPECT_EQ(recovering.reason(), found) << what << ": " << recovering.message();
  }
  const auto done = wait_for(id, v1::SUCCEEDED);
  EXPECT_EQ(done.state(), v1::SUCCEEDED) << done.message() << logs(id);
  EXPECT_EQ(done.epoch(), epoch + 1);
  EXPECT_EQ(statistics(id).series(0).SerializeAsString(), statistics(undisturbed).series(0).SerializeAsString());
}

}  // namespace
}  // namespace bedflow::test
