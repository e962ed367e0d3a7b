#include "states.h"

namespace bedflow::server {

bool is_final(v1::JobState state) {
  return state == v1::SUCCEEDED || state == v1::FAILED || state == v1::STATE_CANCELLED;
}

bool is_waiting(v1::JobState state) {
  return state == v1::PENDING || state == v1::RECOVERING;
}

bool is_attended(v1::JobState state) {
  return state == v1::STARTING || state == v1::RUNNING || state == v1::SUSPENDING || state == v1::CANCELLING;
}

v1::JobState after_request(v1::JobState now, Request request) {
  const bool starts_or_runs = now == v1::STARTING || now == v1::RUNNING;
  switch (request) {
    case Request::cancel:
      if (now == v1::CANCELLING || now == v1::STATE_CANCELLED) return now;
      if (starts_or_runs || now == v1::SUSPENDING) return v1::CANCELLING;
      return is_waiting(now) || now == v1::STATE_SUSPENDED ? v1::STATE_CANCELLED : v1::STATE_UNKNOWN;
    case Request::suspend:
      if (now == v1::SUSPENDING || now == v1::STATE_SUSPENDED) return now;
      if (starts_or_runs) return v1::SUSPENDING;
      return is_waiting(now) ? v1::STATE_SUSPENDED : v1::STATE_UNKNOWN;
    case Request::resume:
      return now == v1::STATE_SUSPENDED || now == v1::FAILED ? v1::PENDING : v1::STATE_UNKNOWN;
    case Request::checkpoint:
      return now == v1::RUNNING ? now : v1::STATE_UNKNOWN;
  }
  return v1::STATE_UNKNOWN;
}

v1::JobState after_attempt(v1::JobState now, v1::StopReason reason, bool may_retry) {
  if (reason == v1::FINISHED) return v1::SUCCEEDED;
  if (reason == v1::CANCELLED) return v1::STATE_CANCELLED;
  if (reason == v1::SUSPENDED) return now == v1::CANCELLING ? v1::STATE_CANCELLED : v1::STATE_SUSPENDED;
  if (now == v1::CANCELLING) return v1::STATE_CANCELLED;                              // it was to end, and it has
  if (reason == v1::DISK_FULL) return v1::STATE_SUSPENDED;                            // resumed by a user who has made room
  if (reason == v1::WALL_LIMIT && now == v1::SUSPENDING) return v1::STATE_SUSPENDED;  // there is a checkpoint, as was asked
  if (!is_worth_a_retry(reason)) return v1::FAILED;
  if (now == v1::SUSPENDING) return v1::STATE_SUSPENDED;  // resumes from the newest checkpoint
  return may_retry ? v1::RECOVERING : v1::FAILED;
}

bool is_worth_a_retry(v1::StopReason reason) {
  switch (reason) {
    case v1::RANK_DIED:
    case v1::HEARTBEAT_LOST:
    case v1::NODE_LOST:
    case v1::BACKEND_ERROR:
    case v1::STALE_EPOCH:
    case v1::INTERNAL:
      return true;
    default:
      return false;
  }
}

const char* state_word(v1::JobState state) {
  switch (state) {
    case v1::STATE_SUSPENDED:
      return "SUSPENDED";
    case v1::STATE_CANCELLED:
      return "CANCELLED";
    case v1::STATE_UNKNOWN:
      return "UNKNOWN";
    default:
      return v1::JobState_Name(state).c_str();
  }
}

}  // namespace bedflow::server
