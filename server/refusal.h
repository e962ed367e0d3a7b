// Why a call is refused, free of gRPC: service.cpp makes a status of it.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bedflow/v1/service.pb.h"

namespace bedflow::server {

enum class Refused {
  invalid_case,          // the case, with all faults by path
  bad_request,           // another field of the request
  job_not_found,         //
  checkpoint_not_found,  //
  study_not_found,       //
  series_not_found,      //
  wrong_state,           // the job's state does not allow it
  quota,                 // of the owner, or of all
  request_id_reused,     // the same id with another content
  not_owner,             // the job is another's, and the caller no admin
  scope_too_small,       // the caller's token does not go so far
  token_not_found,       //
  token_ended,           // it expired or was revoked while the call went on
  job_deleted,           // the job that the request id made
  timed_out,             // not within the time given
  checkpoint_corrupt,    //
  checkpoint_changed,    // it is not the one that a download began with
  bad_upload,            // what was sent is not what was announced
  reader_failed,         // the process that was to read a checkpoint crashed
  too_much,              // more memory, time or bytes than one call is given, or too many such calls at once
  log_damaged,           // a record in the middle of a job's log
  disk_full,             //
  going_down,            // the server, not the job
  backend_error,         // the engine could not be asked
};

class Refusal : public std::runtime_error {
 public:
  Refusal(Refused why_refused, const std::string& message, std::string next_command = {}, std::vector<v1::Fault> all_faults = {})
      : std::runtime_error(message), why(why_refused), next(std::move(next_command)), faults(std::move(all_faults)) {}

  Refused why;
  std::string next;  // the command that helps
  std::vector<v1::Fault> faults;
};

}  // namespace bedflow::server
