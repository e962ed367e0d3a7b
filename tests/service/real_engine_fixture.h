// bedflow-engine itself, under a server or alone, and a bed for it.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "case_file.h"
#include "folder.h"
#include "follow.h"
#include "process.h"
#include "support/server_process.h"

namespace bedflow::test {

// A box of falling and colliding particles in gas: some seconds of wall time, all parts of the engine at work.
inline v1::CreateJobRequest bed(std::uint32_t ranks, double end) {
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
  explicit RealEngine(std::vector<std::string> arguments = {}, const std::filesystem::path& data = {})
      : server_(BEDFLOW_BIN_DIR "/bedflowd", data.empty() ? folder_.path() / "data" : data, BEDFLOW_BIN_DIR "/bedflow-engine",
                std::move(arguments)) {}

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
  ServerProcess server_;
};

// A job folder for the engine alone.
class EngineJob {
 public:
  explicit EngineJob(const v1::CreateJobRequest& request) {
    std::filesystem::create_directories(folder.attempts());
    server::write_durably(folder.case_file(), case_text(request.case_()));
    server::write_durably(folder.spec(), request.spec());
  }
  pid_t start(std::uint32_t epoch) const {
    std::filesystem::create_directories(folder.attempt(epoch));
    return server::launch(
        {.command = {BEDFLOW_BIN_DIR "/bedflow-engine", folder.root(), "--epoch", std::to_string(epoch)}, .environment = {}});
  }
  int run(std::uint32_t epoch) const { return server::wait_for_exit(start(epoch)); }
  std::vector<v1::Event> events() const {
    std::vector<v1::Event> all;
    LogReader reader(folder.events());
    EXPECT_TRUE(reader.read([&](const LogRecord& record) { all.push_back(server::event_of(record)); }));
    return all;
  }

 private:
  TemporaryFolder home_;

 public:
  const server::JobFolder folder{home_.path() / "job"};
};

}  // namespace bedflow::test
