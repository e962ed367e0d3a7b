// Calls and their refusals: what a client may rely on.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>

#include <fstream>
#include <limits>
#include <set>
#include <thread>

#include "process.h"
#include "service_fixture.h"

namespace bedflow::test {
namespace {

using grpc::StatusCode;
using testing::Contains;
using testing::HasSubstr;

class Calls : public ServiceTest {};

TEST_F(Calls, ARetryWithTheSameRequestIdGivesTheSameJob) {
  auto request = job_of(1);
  request.set_request_id("retry-0001");
  (*request.mutable_spec()->mutable_labels())["b"] = "2";
  (*request.mutable_spec()->mutable_labels())["a"] = "1";
  EXPECT_EQ(submit(request), submit(request));
  v1::ListJobsResponse jobs;
  ASSERT_TRUE(call(&v1::JobService::Stub::ListJobs, v1::ListJobsRequest(), jobs).ok());
  EXPECT_EQ(jobs.jobs_size(), 1);
}

TEST_F(Calls, ARetryAfterACrashGivesTheSameJob) {
  auto request = job_of(1);
  request.set_request_id("retry-0002");
  const auto id = submit(request);
  server_.kill();
  server_.start();
  EXPECT_EQ(submit(request), id);
}

TEST_F(Calls, SimultaneousRetriesMakeOneJob) {
  auto request = job_of(1);
  request.set_request_id("retry-0003");
  std::vector<std::string> ids(8);
  {
    std::vector<std::jthread> clients;
    clients.reserve(ids.size());
    for (auto& id : ids) clients.emplace_back([&] { id = submit(request); });
  }
  EXPECT_EQ(std::set<std::string>(ids.begin(), ids.end()).size(), 1u);
}

TEST_F(Calls, AnotherCaseUnderTheSameRequestIdIsRefused) {
  auto request = job_of(1);
  request.set_request_id("retry-0004");
  submit(request);
  request.mutable_case_()->mutable_gas()->set_density(1.3);
  v1::CreateJobResponse response;
  expect_refused(create(request, response), StatusCode::ALREADY_EXISTS, "REQUEST_ID_REUSED");
}

TEST_F(Calls, AnInvalidCaseListsAllFaultsByPath) {
  auto request = job_of(1);
  request.mutable_case_()->mutable_gas()->set_density(-1);
  request.mutable_case_()->mutable_gas()->set_viscosity(std::numeric_limits<double>::quiet_NaN());
  request.mutable_case_()->clear_gravity();
  request.mutable_spec()->set_ranks(0);
  v1::CreateJobResponse response;
  const auto status = create(request, response);
  expect_refused(status, StatusCode::INVALID_ARGUMENT, "INVALID_CASE");
  std::vector<std::string> paths;
  const auto detail = detail_of(status);
  for (const auto& fault : detail.faults()) paths.push_back(fault.path());
  EXPECT_THAT(paths, testing::IsSupersetOf({"gas.density", "gas.viscosity", "gravity", "spec.ranks"}));
}

TEST_F(Calls, WhatOnlyTheEngineFindsIsRefusedByPathToo) {
  v1::CreateJobResponse response;
  const auto status = create(job_of(1, "refuse=time.step"), response);
  expect_refused(status, StatusCode::INVALID_ARGUMENT, "INVALID_CASE");
  ASSERT_EQ(detail_of(status).faults_size(), 1);
  EXPECT_EQ(detail_of(status).faults(0).path(), "time.step");
}

TEST_F(Calls, FieldsThatTheServerDoesNotKnowAreRefused) {
  auto request = job_of(1);
  auto& gas = *request.mutable_case_()->mutable_gas();
  gas.GetReflection()->MutableUnknownFields(&gas)->AddVarint(1999, 1);
  v1::CreateJobResponse response;
  expect_refused(create(request, response), StatusCode::INVALID_ARGUMENT, "INVALID_CASE");
}

TEST_F(Calls, ValidateOnlyGivesThePlanAndMakesNoJob) {
  auto request = job_of(25);
  request.set_validate_only(true);
  v1::CreateJobResponse response;
  ASSERT_TRUE(create(request, response).ok());
  EXPECT_FALSE(response.has_job());
  EXPECT_EQ(response.plan().steps(), 25u);
  v1::ListJobsResponse jobs;
  ASSERT_TRUE(call(&v1::JobService::Stub::ListJobs, v1::ListJobsRequest(), jobs).ok());
  EXPECT_EQ(jobs.jobs_size(), 0);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path() / "data" / "drafts"));
}

TEST_F(Calls, HostileIdsAreRefusedByEveryCall) {
  for (const std::string id :
       {"", "../../../etc/passwd", "j-0123456789ab/../..", "j-'; DROP TABLE jobs", "j-%00%00%00%00%00%00"}) {
    v1::Job job;
    expect_refused(get(id, job), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
    expect_refused(cancel(id), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
    expect_refused(suspend(id), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
    expect_refused(resume(id), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
    v1::QueryStatisticsRequest query;
    query.set_id(id);
    v1::Statistics statistics;
    expect_refused(call(&v1::JobService::Stub::QueryStatistics, query, statistics), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
    v1::ListCheckpointsRequest list;
    list.set_id(id);
    v1::ListCheckpointsResponse checkpoints;
    expect_refused(call(&v1::JobService::Stub::ListCheckpoints, list, checkpoints), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
    auto request = job_of(1);
    request.mutable_start_from()->set_job(id);
    v1::CreateJobResponse response;
    expect_refused(create(request, response), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
  }
  auto request = job_of(1);
  request.set_request_id("../../etc/x");
  v1::CreateJobResponse response;
  expect_refused(create(request, response), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
}

TEST_F(Calls, AJobThatIsNotThereIsNotFound) {
  v1::Job job;
  expect_refused(get("j-000000000000", job), StatusCode::NOT_FOUND, "JOB_NOT_FOUND");
}

TEST_F(Calls, TheEffectiveCaseIsGivenOnRequestOnly) {
  const auto id = submit(job_of(1));
  v1::Job with, without;
  ASSERT_TRUE(get(id, with, true).ok());
  ASSERT_TRUE(get(id, without).ok());
  EXPECT_EQ(with.case_().gas().density(), 1.2);
  EXPECT_FALSE(without.has_case_());
}

TEST_F(Calls, PagesShowEachJobOnceNewestFirst) {
  std::vector<std::string> submitted;
  for (int i = 0; i < 7; ++i) {
    auto request = job_of(1);
    (*request.mutable_spec()->mutable_labels())["parity"] = i % 2 == 0 ? "even" : "odd";
    submitted.insert(submitted.begin(), submit(request));
  }
  v1::ListJobsRequest request;
  request.set_page_size(3);
  std::vector<std::string> listed;
  std::vector<int> sizes;
  do {
    v1::ListJobsResponse page;
    ASSERT_TRUE(call(&v1::JobService::Stub::ListJobs, request, page).ok());
    for (const auto& job : page.jobs()) listed.push_back(job.id());
    sizes.push_back(page.jobs_size());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty() && sizes.size() < 10);
  EXPECT_EQ(listed, submitted);
  EXPECT_THAT(sizes, testing::ElementsAre(3, 3, 1));
  v1::ListJobsRequest odd;
  (*odd.mutable_labels())["parity"] = "odd";
  v1::ListJobsResponse found;
  ASSERT_TRUE(call(&v1::JobService::Stub::ListJobs, odd, found).ok());
  EXPECT_EQ(found.jobs_size(), 3);
}

TEST_F(Calls, BadPagesAreRefused) {
  v1::ListJobsRequest request;
  v1::ListJobsResponse response;
  request.set_page_size(1001);
  expect_refused(call(&v1::JobService::Stub::ListJobs, request, response), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
  request.set_page_size(1);
  request.set_page_token("1; DROP TABLE jobs");
  expect_refused(call(&v1::JobService::Stub::ListJobs, request, response), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
}

TEST_F(Calls, ServerInfoSaysWhatThereIs) {
  v1::ServerInfo info;
  ASSERT_TRUE(call(&v1::JobService::Stub::GetServerInfo, v1::GetServerInfoRequest(), info).ok());
  EXPECT_EQ(info.executors(0), "local");
  EXPECT_GE(info.slots(), 4u);
  EXPECT_GT(info.disk_free_bytes(), 0u);
  EXPECT_EQ(info.address(), server_.address());
  EXPECT_THAT(info.built_laws(), Contains("gas.solver.simple"));
}

// ------------------------------------------------------------------------------------------ health and reflection

// Sends one message by hand and returns the bytes of the first answer: Debian ships no protos of these services.
std::string answer_of(const std::shared_ptr<grpc::Channel>& channel, const std::string& method, const std::string& bytes) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
  grpc::CompletionQueue queue;
  const auto stream = stub.PrepareCall(&context, method, &queue);
  void* tag = nullptr;
  bool ok = false;
  const auto wait = [&] { return queue.Next(&tag, &ok) && ok; };
  stream->StartCall(nullptr);
  if (!wait()) return "";
  const grpc::Slice slice(bytes);
  stream->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
  if (!wait()) return "";
  grpc::ByteBuffer answer;
  stream->Read(&answer, nullptr);
  if (!wait()) return "";
  grpc::Status status;
  stream->Finish(&status, nullptr);
  wait();
  std::vector<grpc::Slice> slices;
  (void)answer.Dump(&slices);
  std::string text;
  for (const auto& part : slices) text.append(reinterpret_cast<const char*>(part.begin()), part.size());
  return text;
}

TEST_F(Calls, HealthSaysServing) {
  EXPECT_EQ(answer_of(server_.channel(), "/grpc.health.v1.Health/Check", ""), "\x08\x01");  // status = SERVING
}

TEST_F(Calls, ReflectionListsTheService) {
  const std::string list_services("\x3a\x00", 2);  // field 7, empty text
  EXPECT_THAT(answer_of(server_.channel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", list_services),
              HasSubstr("bedflow.v1.JobService"));
}

TEST_F(Calls, BytesThatAreNoMessageDoNoHarm) {
  EXPECT_EQ(answer_of(server_.channel(), "/bedflow.v1.JobService/GetJob", std::string(1000, '\xff')), "");
  EXPECT_EQ(answer_of(server_.channel(), "/grpc.health.v1.Health/Check", ""), "\x08\x01");
}

// ------------------------------------------------------------------------------------------------- start of the server

std::string output_of_start(const std::vector<std::string>& arguments, int& exit_code) {
  std::vector<std::string> command = {server_program};
  command.insert(command.end(), arguments.begin(), arguments.end());
  const auto answer = server::ask(command, std::chrono::seconds(10), 1 << 20);
  exit_code = answer.exit_code;
  return answer.error;
}

TEST_F(Calls, AddressesBeyondTheMachineAreRefusedBeforeAnythingIsMade) {
  int exit_code = 0;
  const auto other = folder_.path() / "other";
  EXPECT_THAT(output_of_start({"--data", other, "--listen", "0.0.0.0:0"}, exit_code),
              HasSubstr("without TLS and authentication"));
  EXPECT_EQ(exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(other));
}

TEST_F(Calls, ASecondServerOnTheSameFolderIsRefused) {
  int exit_code = 0;
  EXPECT_THAT(output_of_start({"--data", folder_.path() / "data"}, exit_code), HasSubstr("another bedflowd serves"));
  EXPECT_EQ(exit_code, 1);
}

TEST_F(Calls, TheDataFolderIsPrivate) {
  EXPECT_EQ(std::filesystem::status(folder_.path() / "data").permissions(), std::filesystem::perms::owner_all);
}

class IdleServer : public ServiceTest {
 protected:
  IdleServer() : ServiceTest({"--idle-exit", "--idle-seconds", "0.3", "--listen", "127.0.0.1:0"}) {}
};

TEST_F(IdleServer, EndsByItselfAfterItsLastJobAndServesOnLoopback) {
  EXPECT_THAT(server_.address(), testing::StartsWith("127.0.0.1:"));
  const auto id = submit(job_of(100, "step_ms=5"));
  wait_for(id, v1::SUCCEEDED);
  EXPECT_TRUE(holds_within(std::chrono::seconds(10), [&] { return !server::start_ticks(server_.pid()); }));
}

}  // namespace
}  // namespace bedflow::test
