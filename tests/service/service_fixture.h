// A server with the fake engine, and the calls that the tests make.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "support/server_process.h"

namespace bedflow::test {

inline const std::string server_program = BEDFLOW_BIN_DIR "/bedflowd";

// A good case of so many steps for the fake engine; `asks` as in fake_engine.cpp.
inline v1::CreateJobRequest job_of(int steps, const std::string& asks = "") {
  v1::CreateJobRequest request;
  auto& scene = *request.mutable_case_();
  scene.set_name("fake");
  scene.set_description(asks);
  auto& size = *scene.mutable_domain()->mutable_size();
  size.set_x(0.1), size.set_y(0.1), size.set_z(0.1);
  auto& cells = *scene.mutable_domain()->mutable_cells();
  cells.set_x(4), cells.set_y(4), cells.set_z(4);
  scene.mutable_gravity()->set_y(-9.81);
  scene.mutable_gas()->set_density(1.2);
  scene.mutable_gas()->set_viscosity(1.8e-5);
  scene.mutable_gas()->mutable_simple();
  scene.mutable_gas()->mutable_upwind();
  scene.mutable_time()->set_step(0.01);
  scene.mutable_time()->set_end(0.01 * steps);
  request.mutable_spec()->mutable_checkpoints()->set_every_steps(10);
  return request;
}

class ServiceTest : public testing::Test {
 protected:
  explicit ServiceTest(std::vector<std::string> arguments = {})
      : server_(server_program, folder_.path() / "data", BEDFLOW_FAKE_ENGINE, std::move(arguments)) {}

  grpc::Status create(const v1::CreateJobRequest& request, v1::CreateJobResponse& response) {
    grpc::ClientContext context;
    return stub().CreateJob(&context, request, &response);
  }
  std::string submit(const v1::CreateJobRequest& request) {
    v1::CreateJobResponse response;
    const auto status = create(request, response);
    EXPECT_TRUE(status.ok()) << status.error_message() << "\n" << detail_of(status).DebugString();
    return response.job().id();
  }
  grpc::Status get(const std::string& id, v1::Job& job, bool with_case = false) {
    grpc::ClientContext context;
    v1::GetJobRequest request;
    request.set_id(id);
    request.set_with_case(with_case);
    return stub().GetJob(&context, request, &job);
  }
  v1::Job job(const std::string& id) {
    v1::Job found;
    EXPECT_TRUE(get(id, found).ok());
    return found;
  }
  template <class Request, class Response>
  grpc::Status call(grpc::Status (v1::JobService::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response& response) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
    return (stub().*method)(&context, request, &response);
  }
  template <class Request>
  grpc::Status ask(grpc::Status (v1::JobService::Stub::*method)(grpc::ClientContext*, const Request&, v1::Job*),
                   const std::string& id) {
    Request request;
    request.set_id(id);
    v1::Job response;
    return call(method, request, response);
  }
  grpc::Status suspend(const std::string& id) { return ask(&v1::JobService::Stub::SuspendJob, id); }
  grpc::Status cancel(const std::string& id) { return ask(&v1::JobService::Stub::CancelJob, id); }
  grpc::Status resume(const std::string& id) { return ask(&v1::JobService::Stub::ResumeJob, id); }
  v1::Job wait_for(const std::string& id, v1::JobState state) { return wait_for_state(stub(), id, state); }
  // Until the fake engine has taken so many steps.
  bool has_reached(const std::string& id, std::uint64_t step) {
    return holds_within(std::chrono::seconds(20), [&] { return job(id).progress().step() >= step; });
  }

  v1::JobService::Stub& stub() { return server_.stub(); }

  TemporaryFolder folder_;
  ServerProcess server_;
};

inline void expect_refused(const grpc::Status& status, grpc::StatusCode code, const std::string& reason) {
  EXPECT_EQ(status.error_code(), code) << status.error_message();
  EXPECT_EQ(detail_of(status).reason(), reason);
}

}  // namespace bedflow::test
