// What is removed by itself: jobs that ended long ago, and of jobs that have ended the checkpoints that nobody needs. Never what
// is pinned, never a job that can be resumed, and never a job's newest good checkpoint.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "jobs.h"
#include "reader.h"

namespace bedflow::server {

struct RetentionPolicy {
  std::optional<std::chrono::duration<double>> job_life;  // of jobs that have ended and cannot be resumed
  std::uint32_t checkpoints = 0;                          // of a job that has ended or is suspended so many stay; 0: all
};

struct Removed {
  std::uint64_t jobs = 0, checkpoints = 0, bytes = 0;
};

class Retention {
 public:
  Retention(Jobs& jobs, Readers& readers, RetentionPolicy policy) : jobs_(jobs), readers_(readers), policy_(policy) {}

  bool has_duty() const { return policy_.job_life || policy_.checkpoints > 0; }
  // Looks at every job once; those in use are not removed. What fails is logged, and tried again in the next round.
  void round(const std::vector<v1::Job>& jobs, const std::set<std::string>& in_use);
  const Removed& removed() const { return removed_; }  // since this server began

 private:
  bool is_over(const v1::Job& job);
  void thin(const v1::Job& job);
  std::optional<std::uint64_t> newest_good(const JobFolder& folder, const std::vector<std::uint64_t>& steps);

  Jobs& jobs_;
  Readers& readers_;
  const RetentionPolicy policy_;
  std::set<std::string> thinned_;  // "<job> <when it changed>": nothing new to find there
  Removed removed_;
};

}  // namespace bedflow::server
