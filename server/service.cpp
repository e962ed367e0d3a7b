#include "service.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cmath>
#include <utility>

#include "case_file.h"
#include "query.h"
#include "security.h"

namespace bedflow::server {
namespace {

struct Code {
  grpc::StatusCode status;
  const char* reason;  // stable
};

Code code_of(Refused why) {
  switch (why) {
    case Refused::invalid_case:
      return {grpc::StatusCode::INVALID_ARGUMENT, "INVALID_CASE"};
    case Refused::bad_request:
      return {grpc::StatusCode::INVALID_ARGUMENT, "BAD_REQUEST"};
    case Refused::job_not_found:
      return {grpc::StatusCode::NOT_FOUND, "JOB_NOT_FOUND"};
    case Refused::checkpoint_not_found:
      return {grpc::StatusCode::NOT_FOUND, "CHECKPOINT_NOT_FOUND"};
    case Refused::study_not_found:
      return {grpc::StatusCode::NOT_FOUND, "STUDY_NOT_FOUND"};
    case Refused::series_not_found:
      return {grpc::StatusCode::NOT_FOUND, "SERIES_NOT_FOUND"};
    case Refused::wrong_state:
      return {grpc::StatusCode::FAILED_PRECONDITION, "WRONG_STATE"};
    case Refused::request_id_reused:
      return {grpc::StatusCode::ALREADY_EXISTS, "REQUEST_ID_REUSED"};
    case Refused::not_owner:
      return {grpc::StatusCode::PERMISSION_DENIED, "NOT_OWNER"};
    case Refused::scope_too_small:
      return {grpc::StatusCode::PERMISSION_DENIED, "SCOPE_TOO_SMALL"};
    case Refused::token_not_found:
      return {grpc::StatusCode::NOT_FOUND, "TOKEN_NOT_FOUND"};
    case Refused::token_ended:
      return {grpc::StatusCode::UNAUTHENTICATED, "TOKEN_ENDED"};
    case Refused::job_deleted:
      return {grpc::StatusCode::ALREADY_EXISTS, "JOB_DELETED"};
    case Refused::timed_out:
      return {grpc::StatusCode::DEADLINE_EXCEEDED, "TIMED_OUT"};
    case Refused::checkpoint_corrupt:
      return {grpc::StatusCode::DATA_LOSS, "CHECKPOINT_CORRUPT"};
    case Refused::checkpoint_changed:
      return {grpc::StatusCode::FAILED_PRECONDITION, "CHECKPOINT_CHANGED"};
    case Refused::bad_upload:
      return {grpc::StatusCode::INVALID_ARGUMENT, "BAD_UPLOAD"};
    case Refused::reader_failed:
      return {grpc::StatusCode::INTERNAL, "READER_FAILED"};
    case Refused::too_much:
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MUCH"};
    case Refused::log_damaged:
      return {grpc::StatusCode::DATA_LOSS, "LOG_DAMAGED"};
    case Refused::quota:
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, "QUOTA"};
    case Refused::disk_full:
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, "DISK_FULL"};
    case Refused::going_down:
      return {grpc::StatusCode::UNAVAILABLE, "GOING_DOWN"};
    case Refused::backend_error:
      return {grpc::StatusCode::INTERNAL, "BACKEND_ERROR"};
  }
  return {grpc::StatusCode::INTERNAL, "INTERNAL"};
}

// A stream that is refused.
class Refuse final : public grpc::ServerWriteReactor<v1::WatchJobResponse> {
 public:
  explicit Refuse(const grpc::Status& status) { Finish(status); }
  void OnDone() override { delete this; }
};

}  // namespace

grpc::Status status_of(const Refusal& refusal) {
  constexpr std::size_t most_bytes = 4096;  // gRPC's headers hold 8 KiB, message and encoding included
  const Code code = code_of(refusal.why);
  v1::ErrorDetail detail;
  detail.set_reason(code.reason);
  if (!refusal.next.empty()) detail.set_next(refusal.next);
  if (refusal.why == Refused::going_down) detail.set_retry_after_seconds(1);
  std::size_t sent = 0;
  for (; sent < refusal.faults.size() && detail.ByteSizeLong() + refusal.faults[sent].ByteSizeLong() < most_bytes; ++sent) {
    *detail.add_faults() = refusal.faults[sent];
  }
  if (const auto left = refusal.faults.size() - sent; left > 0)
    detail.add_faults()->set_text("and " + std::to_string(left) + " more");
  return {code.status, std::string(refusal.what()).substr(0, 1024), detail.SerializeAsString()};
}

grpc::Status status_of_failure(const std::exception& failure) {
  if (const auto* refusal = dynamic_cast<const Refusal*>(&failure)) return status_of(*refusal);
  const auto* system = dynamic_cast<const std::system_error*>(&failure);
  if (system && system->code() == std::errc::no_space_on_device) {
    return status_of({Refused::disk_full, failure.what(), "bedflow server info"});
  }
  spdlog::error("call failed: {}", failure.what());
  v1::ErrorDetail detail;
  detail.set_reason("INTERNAL");
  return {grpc::StatusCode::INTERNAL, failure.what(), detail.SerializeAsString()};
}

JobService::Unary* JobService::answer(Context* context, Pace pace, std::function<void(const Caller&)> call) {
  last_call_ = std::chrono::steady_clock::now();
  ++calls_;
  Unary* reactor = context->DefaultReactor();
  boost::asio::post(pool(pace), [this, context, reactor, call = std::move(call)] {
    grpc::Status status;
    try {
      call(door_.caller(*context));
    } catch (const std::exception& failure) {
      status = status_of_failure(failure);
    }
    reactor->Finish(status);
    --calls_;
  });
  return reactor;
}

void JobService::wait_for_calls() {
  quick_.join();
  slow_.join();
  reading_.join();
}

std::chrono::steady_clock::duration JobService::quiet() const {
  return std::chrono::steady_clock::now() - last_call_.load();
}

JobService::Unary* JobService::CreateJob(Context* context, const v1::CreateJobRequest* request, v1::CreateJobResponse* response) {
  return answer(context, Pace::slow, [=, this](const Caller& caller) { *response = jobs_.create(caller, *request); });
}

JobService::Unary* JobService::GetJob(Context* context, const v1::GetJobRequest* request, v1::Job* response) {
  return answer(context, Pace::quick, [=, this](const Caller&) {
    *response = jobs_.get(request->id());
    if (request->with_case()) *response->mutable_case_() = jobs_.read_case(request->id());
  });
}

JobService::Unary* JobService::ListJobs(Context* context, const v1::ListJobsRequest* request, v1::ListJobsResponse* response) {
  return answer(context, Pace::quick, [=, this](const Caller&) { *response = jobs_.list(*request); });
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* JobService::WatchJob(Context* context, const v1::WatchJobRequest* request) {
  last_call_ = std::chrono::steady_clock::now();
  try {
    return watchers_.open(request->id(), jobs_.watch(request->id(), request->after_sequence(), request->from_now()),
                          door_.caller(*context));
  } catch (const std::exception& failure) {
    return new Refuse(status_of_failure(failure));
  }
}

JobService::Unary* JobService::CancelJob(Context* context, const v1::CancelJobRequest* request, v1::Job* response) {
  return answer(context, Pace::quick,
                [=, this](const Caller& caller) { *response = jobs_.cancel(caller, request->id(), request->skip_checkpoint()); });
}

JobService::Unary* JobService::SuspendJob(Context* context, const v1::SuspendJobRequest* request, v1::Job* response) {
  return answer(context, Pace::quick, [=, this](const Caller& caller) { *response = jobs_.suspend(caller, request->id()); });
}

JobService::Unary* JobService::ResumeJob(Context* context, const v1::ResumeJobRequest* request, v1::Job* response) {
  return answer(context, Pace::quick, [=, this](const Caller& caller) { *response = jobs_.resume(caller, *request); });
}

JobService::Unary* JobService::QueryStatistics(Context* context, const v1::QueryStatisticsRequest* request,
                                               v1::Statistics* response) {
  return answer(context, Pace::slow,
                [=, this](const Caller&) { *response = statistics_.query(jobs_.folder(request->id()), *request); });
}

JobService::Unary* JobService::ListSeries(Context* context, const v1::ListSeriesRequest* request,
                                          v1::ListSeriesResponse* response) {
  return answer(context, Pace::slow,
                [=, this](const Caller&) { *response = statistics_.list(jobs_.folder(request->id()), request->id()); });
}

JobService::Unary* JobService::DeleteJob(Context* context, const v1::DeleteJobRequest* request, v1::DeleteJobResponse* response) {
  return answer(context, Pace::slow,
                [=, this](const Caller& caller) { response->set_freed_bytes(jobs_.remove(caller, request->id())); });
}

JobService::Unary* JobService::GetCheckpoint(Context* context, const v1::GetCheckpointRequest* request,
                                             v1::Checkpoint* response) {
  return answer(context, Pace::reading, [=, this](const Caller&) {
    *response = get_checkpoint(readers_, jobs_.folder(request->name().job()), request->name());
  });
}

JobService::Unary* JobService::VerifyCheckpoint(Context* context, const v1::VerifyCheckpointRequest* request,
                                                v1::VerifyCheckpointResponse* response) {
  return answer(context, Pace::reading, [=, this](const Caller&) {
    *response = verify_checkpoint(readers_, jobs_.folder(request->name().job()), request->name());
  });
}

JobService::Unary* JobService::ListCheckpoints(Context* context, const v1::ListCheckpointsRequest* request,
                                               v1::ListCheckpointsResponse* response) {
  return answer(context, Pace::slow,
                [=, this](const Caller&) { *response = list_checkpoints(jobs_.folder(request->id()), request->id()); });
}

JobService::Unary* JobService::CreateCheckpoint(Context* context, const v1::CreateCheckpointRequest* request,
                                                v1::Checkpoint* response) {
  return answer(context, Pace::slow, [=, this](const Caller& caller) {
    const double limit = request->timeout_seconds();
    if (!std::isfinite(limit) || limit <= 0 || limit > 3600) {
      throw Refusal(Refused::bad_request, "timeout_seconds is " + std::to_string(limit) + "; allowed are above 0 to 3600 s");
    }
    const std::chrono::duration<double> given = context->deadline() - std::chrono::system_clock::now();
    *response = jobs_.create_checkpoint(caller, request->id(), std::min(std::chrono::duration<double>(limit), given));
  });
}

JobService::Unary* JobService::GetSnapshot(Context* context, const v1::GetSnapshotRequest* request, v1::Snapshot* response) {
  return answer(context, Pace::reading,
                [=, this](const Caller&) { *response = snapshot(engine_, jobs_.folder(request->id()), *request); });
}

JobService::Unary* JobService::GetServerInfo(Context* context, const v1::GetServerInfoRequest*, v1::ServerInfo* response) {
  return answer(context, Pace::quick, [=, this](const Caller& caller) {
    *response = jobs_.info();
    response->set_address(address_.get());
    response->set_caller(caller.owner);
    response->set_caller_scope(caller.scope);
  });
}

JobService::Unary* JobService::SetPin(Context* context, const v1::SetPinRequest* request, v1::Job* response) {
  return answer(context, Pace::quick, [=, this](const Caller& caller) { *response = jobs_.set_pin(caller, *request); });
}

JobService::Unary* JobService::GetUsage(Context* context, const v1::GetUsageRequest* request, v1::Usage* response) {
  return answer(context, Pace::slow, [=, this](const Caller&) { *response = housekeeping_.usage(*request); });
}

}  // namespace bedflow::server
