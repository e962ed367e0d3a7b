// The calls about studies.
#include "service.h"

namespace bedflow::server {

JobService::Unary* JobService::CreateStudy(Context* context, const v1::CreateStudyRequest* request, v1::Study* response) {
  return answer(context, Pace::slow, [=, this](const Caller& caller) { *response = studies_.create(caller, *request); });
}

JobService::Unary* JobService::GetStudy(Context* context, const v1::GetStudyRequest* request, v1::Study* response) {
  return answer(context, Pace::slow, [=, this](const Caller&) { *response = studies_.get(request->id()); });
}

JobService::Unary* JobService::ListStudies(Context* context, const v1::ListStudiesRequest*, v1::ListStudiesResponse* response) {
  return answer(context, Pace::quick, [=, this](const Caller&) { *response = studies_.list(); });
}

JobService::Unary* JobService::CancelStudy(Context* context, const v1::CancelStudyRequest* request, v1::Study* response) {
  return answer(context, Pace::quick, [=, this](const Caller& caller) { *response = studies_.cancel(caller, request->id()); });
}

JobService::Unary* JobService::DeleteStudy(Context* context, const v1::DeleteStudyRequest* request,
                                           v1::DeleteStudyResponse* response) {
  return answer(context, Pace::slow, [=, this](const Caller& caller) {
    response->set_freed_bytes(studies_.remove(caller, request->id(), request->with_jobs()));
  });
}

}  // namespace bedflow::server
