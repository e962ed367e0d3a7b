// How the program ends: the exit codes that scripts rely on, and what a failure tells people.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "bedflow/v1/service.pb.h"
#include "case_file.h"

namespace bedflow::client {

enum class Exit : int {
  ok = 0,
  other = 1,
  usage = 2,  // usage or invalid case
  job_failed = 3,
  not_allowed = 4,
  not_found = 5,
  wrong_state = 6,
  unreachable = 7,
  timed_out = 8,
  limit = 9,  // limit, quota or disk
  cancelled = 10,
  corrupt = 11,
  interrupted = 130,
};

// What happened, with the value and the allowed range; what helps next; and every fault when it is a case that is wrong.
struct Failure : std::runtime_error {
  Failure(Exit exit_code, const std::string& what_happened, std::string next_command = {},
          std::vector<CaseFault> case_faults = {})
      : std::runtime_error(what_happened), code(exit_code), next(std::move(next_command)), faults(std::move(case_faults)) {}
  Exit code;
  std::string next;
  std::vector<CaseFault> faults;
};

void print_failure(const Failure& failure);  // on stderr

bool is_final(v1::JobState state);  // no engine runs and none will without a command
Exit exit_of(const v1::Job& job);   // of a job that is final
std::string state_name(v1::JobState state);
std::string reason_name(v1::StopReason reason);

}  // namespace bedflow::client
