// The promises of the service on bedflow-engine itself.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>

#include "folder.h"
#include "service_fixture.h"

namespace bedflow::test {
namespace {

// A box of falling and colliding particles in gas: some seconds of wall time, all parts of the engine at work.
v1::CreateJobRequest bed(std::uint32_t ranks, double end) {
  v1::CreateJobRequest request;
  auto& scene = *request.mutable_case_();
  scene.set_name("small-bed");
  auto& size = *scene.mutable_domain()->mutable_size();
  size.set_x(0.024), size.set_y(0.048), size.set_z(0.01);
  auto& cells = *scene.mutable_domain()->mutable_cells();
  cells.set_x(8), cells.set_y(16), cells.set_z(4);
  scene.mutable_domain()->mutable_faces()->mutable_y_low()->mutable_inflow()->set_velocity(0.5);
  scene.mutable_domain()->mutable_faces()->mutable_y_high()->mutable_outflow();
  scene.mutable_gravity()->set_y(-9.81);
  auto& gas = *scene.mutable_gas();
  gas.set_density(1.2);
  gas.set_viscosity(1.8e-5);
  gas.mutable_simple();
  gas.mutable_upwind();
  auto& particles = *scene.mutable_particles();
  particles.set_diameter(1.2e-3);
  particles.set_density(1000);
  particles.mutable_linear_spring_dashpot()->set_stiffness(440);
  particles.mutable_linear_spring_dashpot()->set_restitution(0.9);
  particles.mutable_spring()->set_friction(0.1);
  particles.mutable_random()->set_count(500);
  particles.mutable_random()->set_seed(1);
  auto& region = *particles.mutable_random()->mutable_region();
  region.mutable_low();
  region.mutable_high()->set_x(0.024);
  region.mutable_high()->set_y(0.02);
  region.mutable_high()->set_z(0.01);
  particles.mutable_symplectic_euler();
  auto& coupling = *scene.mutable_coupling();
  coupling.mutable_gidaspow_blended();
  coupling.mutable_hat();
  coupling.mutable_explicit_();
  scene.mutable_time()->set_end(end);
  auto& energy = *scene.add_monitors();
  energy.set_name("kinetic_energy");
  energy.mutable_kinetic_energy();
  energy.set_interval(0.0005);
  request.mutable_spec()->set_ranks(ranks);
  request.mutable_spec()->mutable_checkpoints()->set_every_simulated_seconds(0.005);
  request.mutable_spec()->mutable_checkpoints()->set_keep(3);
  return request;
}

class RealEngine : public testing::Test {
 protected:
  std::string submit(const v1::CreateJobRequest& request) {
    grpc::ClientContext context;
    v1::CreateJobResponse response;
    const auto status = stub().CreateJob(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message() << "\n" << detail_of(status).DebugString();
    return response.job().id();
  }
  // Until the job's first checkpoint is reported.
  std::vector<v1::WatchJobResponse> watch_to_checkpoint(const std::string& id) {
    return watch(
        stub(), id, 0, [](const auto& response) { return response.event().has_checkpoint(); }, limit);
  }
  v1::Job wait_for(const std::string& id, v1::JobState state) { return wait_for_state(stub(), id, state, limit); }
  v1::Statistics statistics(const std::string& id) {
    grpc::ClientContext context;
    v1::QueryStatisticsRequest request;
    request.set_id(id);
    v1::Statistics answer;
    const auto status = stub().QueryStatistics(&context, request, &answer);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return answer;
  }
  std::string logs(const std::string& id) { return server::last_lines(server::JobFolder(server_.folder(id)).error_log(1), 4000); }
  v1::JobService::Stub& stub() { return server_.stub(); }

  const std::chrono::seconds limit{120};
  TemporaryFolder folder_;
  ServerProcess server_{BEDFLOW_BIN_DIR "/bedflowd", folder_.path() / "data", BEDFLOW_BIN_DIR "/bedflow-engine"};
};

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

}  // namespace
}  // namespace bedflow::test
