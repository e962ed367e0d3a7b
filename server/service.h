// The gRPC face: translates calls to jobs, watchers and queries, and refusals to statuses. Nothing is decided here.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <boost/asio/thread_pool.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <string>

#include "bedflow/v1/service.grpc.pb.h"
#include "door.h"
#include "housekeeping.h"
#include "jobs.h"
#include "reader.h"
#include "refusal.h"
#include "statistics.h"
#include "studies.h"
#include "tokens.h"
#include "watch.h"

namespace bedflow::server {

// Code, message, and v1::ErrorDetail in the details. Faults beyond what gRPC's headers hold are counted, not sent.
grpc::Status status_of(const Refusal& refusal);
grpc::Status status_of_failure(const std::exception& failure);  // of a Refusal too

class JobService final : public v1::JobService::CallbackService {
 public:
  JobService(Jobs& jobs, Studies& studies, Watchers& watchers, Readers& readers, Housekeeping& housekeeping,
             std::filesystem::path engine, const Door& door, Tokens& tokens)
      : jobs_(jobs),
        studies_(studies),
        watchers_(watchers),
        readers_(readers),
        housekeeping_(housekeeping),
        engine_(std::move(engine)),
        door_(door),
        tokens_(tokens) {}
  ~JobService() override { wait_for_calls(); }

  void set_addresses(std::string text) { addresses_.set_value(std::move(text)); }  // to tell people; once
  void wait_for_calls();                                                           // after the gRPC server's shutdown
  void drain() { draining_ = true; }                  // streams of statistics end: the server goes down
  std::size_t calls() const { return calls_; }        // in progress, watchers not counted
  std::chrono::steady_clock::duration quiet() const;  // since the last call

 private:
  using Context = grpc::CallbackServerContext;
  using Unary = grpc::ServerUnaryReactor;
  enum class Pace { quick, slow, reading };  // slow: asks the engine, or waits for it; reading: asks a reader of checkpoints

  Unary* answer(Context* context, Pace pace, std::function<void(const Caller&)> call);
  template <class Response, class Source>
  grpc::ServerWriteReactor<Response>* stream(Context* context, Pace pace, Source source);
  boost::asio::thread_pool& pool(Pace pace) { return pace == Pace::quick ? quick_ : pace == Pace::slow ? slow_ : reading_; }

  Unary* CreateJob(Context*, const v1::CreateJobRequest*, v1::CreateJobResponse*) override;
  Unary* GetJob(Context*, const v1::GetJobRequest*, v1::Job*) override;
  Unary* ListJobs(Context*, const v1::ListJobsRequest*, v1::ListJobsResponse*) override;
  grpc::ServerWriteReactor<v1::WatchJobResponse>* WatchJob(Context*, const v1::WatchJobRequest*) override;
  Unary* CancelJob(Context*, const v1::CancelJobRequest*, v1::Job*) override;
  Unary* SuspendJob(Context*, const v1::SuspendJobRequest*, v1::Job*) override;
  Unary* ResumeJob(Context*, const v1::ResumeJobRequest*, v1::Job*) override;
  Unary* DeleteJob(Context*, const v1::DeleteJobRequest*, v1::DeleteJobResponse*) override;
  Unary* ListSeries(Context*, const v1::ListSeriesRequest*, v1::ListSeriesResponse*) override;
  Unary* QueryStatistics(Context*, const v1::QueryStatisticsRequest*, v1::Statistics*) override;
  grpc::ServerWriteReactor<v1::StreamStatisticsResponse>* StreamStatistics(Context*, const v1::StreamStatisticsRequest*) override;
  Unary* ListCheckpoints(Context*, const v1::ListCheckpointsRequest*, v1::ListCheckpointsResponse*) override;
  Unary* GetCheckpoint(Context*, const v1::GetCheckpointRequest*, v1::Checkpoint*) override;
  Unary* CreateCheckpoint(Context*, const v1::CreateCheckpointRequest*, v1::Checkpoint*) override;
  Unary* VerifyCheckpoint(Context*, const v1::VerifyCheckpointRequest*, v1::VerifyCheckpointResponse*) override;
  grpc::ServerWriteReactor<v1::DownloadCheckpointResponse>* DownloadCheckpoint(Context*,
                                                                               const v1::DownloadCheckpointRequest*) override;
  grpc::ServerReadReactor<v1::ImportCheckpointRequest>* ImportCheckpoint(Context*, v1::Job*) override;
  grpc::ServerWriteReactor<v1::FieldAnswer>* QueryField(Context*, const v1::QueryFieldRequest*) override;
  Unary* GetSnapshot(Context*, const v1::GetSnapshotRequest*, v1::Snapshot*) override;
  Unary* CreateStudy(Context*, const v1::CreateStudyRequest*, v1::Study*) override;
  Unary* GetStudy(Context*, const v1::GetStudyRequest*, v1::Study*) override;
  Unary* ListStudies(Context*, const v1::ListStudiesRequest*, v1::ListStudiesResponse*) override;
  Unary* CancelStudy(Context*, const v1::CancelStudyRequest*, v1::Study*) override;
  Unary* DeleteStudy(Context*, const v1::DeleteStudyRequest*, v1::DeleteStudyResponse*) override;
  Unary* GetServerInfo(Context*, const v1::GetServerInfoRequest*, v1::ServerInfo*) override;
  Unary* CreateToken(Context*, const v1::CreateTokenRequest*, v1::Token*) override;
  Unary* ListTokens(Context*, const v1::ListTokensRequest*, v1::ListTokensResponse*) override;
  Unary* RevokeToken(Context*, const v1::RevokeTokenRequest*, v1::RevokeTokenResponse*) override;
  Unary* SetPin(Context*, const v1::SetPinRequest*, v1::Job*) override;
  Unary* GetUsage(Context*, const v1::GetUsageRequest*, v1::Usage*) override;

  Jobs& jobs_;
  Studies& studies_;
  Watchers& watchers_;
  Readers& readers_;
  Housekeeping& housekeeping_;
  StatisticsLogs statistics_;
  const std::filesystem::path engine_;
  const Door& door_;
  Tokens& tokens_;
  std::promise<std::string> addresses_;
  std::shared_future<std::string> address_ = addresses_.get_future();
  std::atomic<std::chrono::steady_clock::time_point> last_call_ = std::chrono::steady_clock::now();
  std::atomic<std::size_t> calls_ = 0;
  std::atomic<bool> draining_ = false;
  boost::asio::thread_pool quick_{4};
  boost::asio::thread_pool slow_{16};
  boost::asio::thread_pool reading_{10};  // as many as may read, and two that wait for a place
};

}  // namespace bedflow::server
