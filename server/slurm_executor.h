// Attempts as jobs of Slurm. A thread of its own speaks with Slurm, since its answers may take long; what others ask is answered
// from what that thread saw last.
//
// Submission is made safe by a name that no other attempt has: it is looked for before every try, so that a submission whose
// answer was lost is found and not repeated. Slurm itself may start a job twice, or lose one, when its controller dies in the
// moment; then the claim on the attempt's folder (runner.h) lets one of two begin, and one that is lost is a failed attempt.
//
// The folder of the jobs is on a file system that the server and all nodes share.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "slurm.h"

namespace bedflow::server {

class SlurmExecutor final : public Executor {
 public:
  // news: called from the executor's thread when something may have changed.
  SlurmExecutor(SlurmSettings settings, Programs programs, std::string server_id, std::function<void()> news);
  ~SlurmExecutor() override;

  void start(const JobFolder& folder, const AttemptOrder& order) override;  // writes the batch script; the thread submits it
  Sighting look(const JobFolder& folder, std::uint32_t epoch, std::chrono::steady_clock::duration silence) override;
  void kill(const JobFolder& folder, std::uint32_t epoch) override;
  void withdraw(const JobFolder& folder, std::uint32_t epoch) override;
  void forget(const JobFolder& folder, std::uint32_t epoch) override;
  std::string trouble();  // why Slurm does not answer; empty: it does

 private:
  struct Tracked {                             // an attempt
    std::vector<std::string> submission = {};  // to be done; empty: it has been, or another server did it
    bool looked_for = false;                   // in Slurm's queue, since it is tracked
    std::optional<SlurmJob> seen = {};         // as the queue had it
    std::optional<Ending> refusal = {};        // of its submission
    bool kill = false, withdraw = false;       // asked for
    bool told = false;                         // to Slurm
    bool hurried = false;                      // its end is near: Slurm has been looked at once more at once
  };

  void work();
  bool look_at_queue();
  void submit(const std::string& name);
  void stop(const std::string& name);
  Sighting ended(const Tracked& attempt, const JobFolder& folder, std::uint32_t epoch,
                 std::chrono::steady_clock::duration silence) const;
  void set_trouble(std::string trouble);
  std::vector<std::string> names(const std::function<bool(const Tracked&)>& wanted);
  void hurry();

  const SlurmSettings settings_;
  const Programs programs_;
  const std::string server_id_;
  const std::function<void()> news_;
  std::mutex mutex_;  // over all below
  std::condition_variable changed_;
  std::map<std::string, Tracked> tracked_;  // by name
  std::string trouble_;
  bool hurried_ = false, ending_ = false;
  std::thread thread_;
};

}  // namespace bedflow::server
