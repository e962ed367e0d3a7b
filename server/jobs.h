// The jobs of a server: every change of state passes here. Calls come from any thread (jobs.cpp, create.cpp); one thread advances
// the attempts and the queue (supervise.cpp). The catalogue says what a job is, its folder what its engine does.
//
// Waiting jobs start in the order of queue.h, as soon as slots and memory are free, or at once on an executor that queues by
// itself.
#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "attempt.h"
#include "caller.h"
#include "catalogue.h"
#include "executor.h"
#include "folder.h"
#include "follow.h"
#include "planner.h"
#include "queue.h"
#include "quota.h"
#include "slurm.h"
#include "states.h"

namespace bedflow::server {

struct Settings {
  std::filesystem::path data;  // catalogue.sqlite, jobs/<id>/
  Programs programs;
  std::uint32_t slots = 4;                  // ranks that may run at once on this machine
  double memory_bytes = 0;                  // that their plans may have together; 0: not counted
  std::optional<SlurmSettings> slurm = {};  // no such executor if absent
  std::chrono::seconds heartbeat_limit{30};
  Quotas quotas;
  std::uint64_t disk_reserve = 0;  // bytes; no job starts while less is free
};

// What the housekeeping has found: memory of running jobs, disk of owners and of all.
struct MeasuredUse {
  std::map<std::string, std::uint64_t> memory, owner_bytes;
  std::uint64_t bytes = 0;
};

// The jobs as numbers. entered, failures: since this server began.
struct Figures {
  std::map<v1::JobState, std::uint64_t> jobs, entered;
  std::map<v1::StopReason, std::uint64_t> failures;
  std::uint32_t ranks_in_use = 0, slots = 0;
  std::uint64_t disk_free = 0, disk_reserve = 0;  // bytes
  std::vector<v1::Job> live;
};

struct RemovedCheckpoints {
  std::uint64_t checkpoints = 0, bytes = 0;
};

// Equal messages give equal bytes: maps in order.
std::string content_of(const google::protobuf::Message& message);

// The checkpoint of the step, or the newest. Throws Refusal(checkpoint_not_found).
std::uint64_t existing_step(const JobFolder& folder, const std::string& id, std::optional<std::uint64_t> wanted);

class Jobs {
 public:
  explicit Jobs(Settings settings);  // takes up what earlier servers have left

  // Calls. They throw Refusal; those that make a job or change one, for a caller who may not, too.
  v1::CreateJobResponse create(const Caller& caller, const v1::CreateJobRequest& request);
  v1::Job get(const std::string& id);
  v1::ListJobsResponse list(const v1::ListJobsRequest& request);
  v1::Job cancel(const Caller& caller, const std::string& id, bool skip_checkpoint);
  v1::Job suspend(const Caller& caller, const std::string& id);
  v1::Job resume(const Caller& caller, const v1::ResumeJobRequest& request);
  std::uint64_t remove(const Caller& caller, const std::string& id);  // the bytes that are free again
  v1::Job set_pin(const Caller& caller, const v1::SetPinRequest& request);
  DraftFolder new_draft() const;
  // A suspended job of a draft with a case and a checkpoint. crc: of the file that was sent.
  v1::Job import(const Caller& caller, const v1::ImportCheckpointRequest::Head& head, const JobFolder& draft,
                 const v1::CheckpointReport& report, std::uint32_t crc);
  v1::Checkpoint create_checkpoint(const Caller& caller, const std::string& id, std::chrono::duration<double> limit);
  v1::ServerInfo info();
  JobFolder folder(const std::string& id);    // of a job that exists; it may not have been laid out yet
  v1::Case read_case(const std::string& id);  // the effective case
  Figures figures();
  std::vector<v1::Job> all();         // newest first
  void add_limits(v1::Usage& usage);  // queue, quotas, reserve
  Cursor watch(const std::string& id, std::uint64_t after, bool from_now);

  // The supervising thread: waits for news (0.2 s at most), then takes every attempt and the queue one step on. Returns the jobs
  // that have something new for their watchers.
  std::set<std::string> advance();
  void poke() { notifier_.poke(); }
  void take_measured(MeasuredUse measured);
  // Of a job that is as it was seen, which no engine runs: those steps, and what resumes from earlier ones have left behind. Told
  // in its events. Throws Refusal when it has changed.
  RemovedCheckpoints remove_checkpoints(const v1::Job& seen, const std::vector<std::uint64_t>& steps);
  bool is_idle();       // nothing waits, nothing runs
  void stop_waiting();  // calls that wait for an engine are answered now: the server goes down

 private:
  struct Live {  // a job with an attempt
    JobRecord record;
    Attempt attempt;
    bool adopted = false;          // found, not started by this server
    bool repeat_command = false;   // if one comes before the engine does
    bool skip_checkpoint = false;  // as the last command says
    bool heartbeat_lost = false;
    std::optional<Ending> start_failure = {};                              // its runner could not be started
    std::optional<std::chrono::steady_clock::time_point> stopped_at = {};  // when the engine said so
    std::string waits_for = {};                                            // what its executor says
  };

  JobFolder folder_of(const std::string& id) const { return JobFolder(settings_.data / "jobs" / id); }
  JobRecord record_of(const std::string& id) const;
  JobRecord own_record(const Caller& caller, const std::string& id) const;  // of a job that the caller may act on
  v1::Job view(const JobRecord& record) const;                              // with what the attempt has done since
  v1::Job with_pins(const JobRecord& record) const;                         // view
  void require_no_pin(const JobRecord& record) const;
  std::shared_ptr<Feed> feed_of(const v1::Job& job);
  void tell(JobRecord record, const std::string& text);
  void store(JobRecord& record, v1::JobState state, std::optional<Ending> why = std::nullopt);
  JobRecord& require(JobRecord& record, Request request, const char* wanted) const;
  JobRecord changed_by(const v1::ResumeJobRequest& request, JobRecord record) const;
  v1::Job request(const Caller& caller, const std::string& id, Request request, const char* wanted, v1::Control::Command command,
                  bool skip_checkpoint);

  std::optional<v1::CreateJobResponse> earlier_answer(const std::string& owner, const v1::CreateJobRequest& request,
                                                      const std::string& content) const;
  void start_from(v1::CreateJobRequest& request, JobRecord& record) const;
  void keep_plan(v1::Job& job, const v1::PlanReport& plan) const;  // throws Refusal(invalid_case) when it can never run
  // The record has its owner. imported: a draft's folder with a checkpoint; the record then has its id and state already.
  v1::CreateJobResponse commit(JobRecord& record, const v1::CreateJobRequest& request, const std::string& content,
                               const JobFolder* imported = nullptr);
  v1::Case case_of(const JobRecord& record) const;
  void lay_out(const std::string& id, const std::string& text, const v1::JobSpec& spec) const;

  void finish_removals();
  void adopt();
  void add_executors();
  Executor& executor_of(const JobRecord& record);
  void look_at(Live& live, const Sighting& sighting);
  void take_sighting(Live& live, const Sighting& sighting);
  void end(Live& live, const Sighting& sighting);
  void store_end(JobRecord& record, Ending ending, bool is_nobodys_fault, bool has_gone_on);
  std::optional<JobRecord> next_to_start();
  std::uint64_t running(const std::string& owner) const;  // empty: of all
  Holding holding(const std::string& owner) const;        // empty: of all
  void require_quota(const std::string& owner) const;
  std::string why_not_start(const std::string& owner) const;
  IsHeld is_held() const;
  static void count_time(JobRecord& record, std::int64_t until);  // of the attempt that ended then
  static void add_time_so_far(v1::Job& job);                      // of the attempt that runs
  void start(JobRecord record, std::unique_lock<std::mutex>& guard);

  // The queue and what it is measured by (queueing.cpp).
  Capacities capacities() const;
  std::map<std::string, Use> uses() const;
  std::string waits_for(const JobRecord& record) const;
  void tell_waiting();
  void add_queue(v1::ServerInfo& info);

  Settings settings_;
  Planner planner_;
  LogNotifier notifier_;
  std::mutex mutex_;  // over all below
  std::condition_variable changed_;
  Catalogue catalogue_;
  Queue queue_;
  std::map<std::string, std::unique_ptr<Executor>> executors_;  // by name
  std::unique_ptr<Executor> absent_;                            // for those that are not there
  std::map<std::string, Live> live_;
  struct Told {
    std::string waits_for;
    std::chrono::steady_clock::time_point at;
  };
  std::map<std::string, Told> told_;                  // to watchers, of jobs that wait
  std::map<std::string, std::weak_ptr<Feed>> feeds_;  // of jobs that are watched
  std::set<std::string> news_;
  std::map<v1::JobState, std::uint64_t> entered_;
  std::map<v1::StopReason, std::uint64_t> failures_;
  MeasuredUse measured_;
  bool stopping_ = false;
};

}  // namespace bedflow::server
