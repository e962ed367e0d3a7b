// The client as its users have it: the program itself, against a service in this process that serves canned data.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "bedflow/v1/service.grpc.pb.h"
#include "child.h"

namespace bedflow::client {

inline grpc::Status refusal(grpc::StatusCode code, const std::string& message, const v1::ErrorDetail& detail) {
  return {code, message, detail.SerializeAsString()};
}

inline v1::Job job_of(const std::string& id, v1::JobState state, v1::StopReason reason = v1::FINISHED) {
  v1::Job job;
  job.set_id(id);
  job.set_state(state);
  if (reason != v1::FINISHED) job.set_reason(reason);
  job.set_case_name("mueller");
  job.mutable_spec()->set_ranks(2);
  job.set_created_unix_nanos(1'700'000'000'000'000'000);
  return job;
}

inline v1::Event progress_event(std::uint64_t sequence, double time) {
  v1::Event event;
  event.set_sequence(sequence);
  auto& progress = *event.mutable_progress();
  progress.set_step(static_cast<std::uint64_t>(time * 1e4));
  progress.set_time(time);
  progress.set_end_time(0.5);
  progress.set_wall_seconds(100 * time);
  return event;
}

// What a watcher is sent, one stream after the other; the last is repeated.
struct WatchScript {
  std::vector<v1::WatchJobResponse> messages;
  grpc::Status end;
  bool stay_open = false;  // until the client goes
};

class FakeService final : public v1::JobService::Service {
 public:
  std::map<std::string, grpc::Status> refusals;  // by job id, or by the case's name for CreateJob
  std::map<std::string, v1::Job> jobs;
  v1::Statistics statistics;
  v1::Snapshot snapshot;
  v1::Case job_case;
  std::vector<WatchScript> watches;
  int cancels = 0;

  grpc::Status CreateJob(grpc::ServerContext*, const v1::CreateJobRequest* request, v1::CreateJobResponse* response) override {
    const std::lock_guard lock(mutex_);
    if (refusals.contains(request->case_().name())) return refusals[request->case_().name()];
    request_ids_.push_back(request->request_id());
    if (request_ids_.size() == 1 && lose_first_answer) return {grpc::UNAVAILABLE, "the answer was lost"};
    *response->mutable_job() = job_of("j-000000000001", v1::PENDING);
    return grpc::Status::OK;
  }
  grpc::Status GetJob(grpc::ServerContext*, const v1::GetJobRequest* request, v1::Job* response) override {
    if (refusals.contains(request->id())) return refusals[request->id()];
    *response = jobs[request->id()];
    if (request->with_case()) *response->mutable_case_() = job_case;
    return grpc::Status::OK;
  }
  grpc::Status ListJobs(grpc::ServerContext*, const v1::ListJobsRequest*, v1::ListJobsResponse* response) override {
    for (const auto& [id, job] : jobs) *response->add_jobs() = job;
    return grpc::Status::OK;
  }
  grpc::Status CancelJob(grpc::ServerContext*, const v1::CancelJobRequest* request, v1::Job* response) override {
    ++cancels;
    *response = job_of(request->id(), v1::CANCELLING);
    return grpc::Status::OK;
  }
  grpc::Status QueryStatistics(grpc::ServerContext*, const v1::QueryStatisticsRequest*, v1::Statistics* response) override {
    *response = statistics;
    return grpc::Status::OK;
  }
  grpc::Status GetSnapshot(grpc::ServerContext*, const v1::GetSnapshotRequest*, v1::Snapshot* response) override {
    *response = snapshot;
    return grpc::Status::OK;
  }
  grpc::Status WatchJob(grpc::ServerContext* context, const v1::WatchJobRequest* request,
                        grpc::ServerWriter<v1::WatchJobResponse>* writer) override {
    if (refusals.contains(request->id())) return refusals[request->id()];
    WatchScript script;
    {
      const std::lock_guard lock(mutex_);
      script = watches[std::min(tokens_.size(), watches.size() - 1)];
      tokens_.push_back(request->after_sequence());
    }
    for (const auto& message : script.messages) writer->Write(message);
    changed_.notify_all();
    std::unique_lock lock(mutex_);
    while (script.stay_open && !context->IsCancelled()) changed_.wait_for(lock, std::chrono::milliseconds(20));
    return script.end;
  }

  bool wait_for_watchers(std::size_t count, std::chrono::seconds limit) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, limit, [&] { return tokens_.size() >= count; });
  }
  std::vector<std::uint64_t> tokens() {
    const std::lock_guard lock(mutex_);
    return tokens_;
  }
  std::vector<std::string> request_ids() {
    const std::lock_guard lock(mutex_);
    return request_ids_;
  }
  bool lose_first_answer = false;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::uint64_t> tokens_;
  std::vector<std::string> request_ids_;
};

class Client : public testing::Test {
 protected:
  Client() {
    std::string name = (std::filesystem::temp_directory_path() / "bedflow-client-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    address_ = "unix:" + (folder_ / "s").string();
    start_server();
  }
  ~Client() override {
    stop_server();
    std::filesystem::remove_all(folder_);
  }
  void start_server() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address_, grpc::InsecureServerCredentials());
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
  }
  void stop_server() {
    if (server_) server_->Shutdown(std::chrono::system_clock::now());
    server_.reset();
  }

  static std::string program() { return BEDFLOW_BIN_DIR "/bedflow"; }
  ChildResult bedflow(std::vector<std::string> words, const std::string& input = {}) const {
    words.insert(words.begin(), program());
    words.insert(words.end(), {"--server", address_});
    return run_child(words, input);
  }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  static std::string read(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::filesystem::path folder_;
  std::string address_;
  FakeService service_;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace bedflow::client
