// The states of a job and what may follow what.
//
//   PENDING → STARTING → RUNNING → SUCCEEDED        SUSPENDING → SUSPENDED → PENDING      CANCELLING → CANCELLED
//   STARTING, RUNNING → RECOVERING → STARTING       FAILED → PENDING (resumed by a user)
//   RUNNING → PENDING (its wall limit is over, and it goes on when its turn comes again)
#pragma once

#include <string>

#include "bedflow/v1/job.pb.h"

namespace bedflow::server {

// How an attempt ended.
struct Ending {
  v1::StopReason reason;
  std::string message;
};

enum class Request { cancel, suspend, resume, checkpoint };

bool is_final(v1::JobState state);     // nothing follows but a user's resume of FAILED
bool is_waiting(v1::JobState state);   // for slots: PENDING, RECOVERING
bool is_attended(v1::JobState state);  // an attempt is there: STARTING, RUNNING, SUSPENDING, CANCELLING

// The state that a user's request leads to at once; STATE_UNKNOWN when the present state does not allow it. A request that has
// been obeyed already is allowed and changes nothing.
v1::JobState after_request(v1::JobState now, Request request);

// The state that the end of an attempt leads to. may_retry: retries are left.
v1::JobState after_attempt(v1::JobState now, v1::StopReason reason, bool may_retry);

bool is_worth_a_retry(v1::StopReason reason);  // not the case's fault, nor the user's limit, nor certain to come again
const char* state_word(v1::JobState state);    // for people: "SUSPENDED", not STATE_SUSPENDED

}  // namespace bedflow::server
