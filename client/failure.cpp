#include "failure.h"

#include <cstdio>

#include "terminal.h"

namespace bedflow::client {

void print_failure(const Failure& failure) {
  const Terminal terminal(stderr);
  std::string text = terminal.paint(Colour::red, "bedflow: ") + failure.what() + "\n";
  for (const auto& fault : failure.faults) {
    text += "  " + (fault.path.empty() ? "" : terminal.paint(Colour::bold, fault.path) + ": ") + fault.text + "\n";
  }
  if (!failure.next.empty()) text += "  next: " + failure.next + "\n";
  std::fputs(text.c_str(), stderr);
}

bool is_final(v1::JobState state) {
  return state == v1::SUCCEEDED || state == v1::FAILED || state == v1::STATE_CANCELLED || state == v1::STATE_SUSPENDED;
}

Exit exit_of(const v1::Job& job) {
  switch (job.state()) {
    case v1::SUCCEEDED:
      return Exit::ok;
    case v1::STATE_CANCELLED:
      return Exit::cancelled;
    case v1::FAILED:
      return job.reason() == v1::CHECKPOINT_CORRUPT ? Exit::corrupt : Exit::job_failed;
    default:
      return Exit::wrong_state;
  }
}

// The schema's names carry a prefix where two enums of the package would clash.
std::string state_name(v1::JobState state) {
  std::string name = v1::JobState_Name(state);
  if (name.empty()) return "UNKNOWN";
  return name.starts_with("STATE_") ? name.substr(6) : name;
}

std::string reason_name(v1::StopReason reason) {
  return v1::StopReason_Name(reason);
}

}  // namespace bedflow::client
