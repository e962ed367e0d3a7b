// Studies: each a folder data/studies/<id> with what was asked (spec.txtpb) and what has come of it (study.txtpb). Its runs are
// jobs like any others, created with request ids that follow from the study's, so a server that takes a study up finds them
// again and starts none twice.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "jobs.h"
#include "statistics.h"
#include "study_results.h"

namespace bedflow::server {

class Studies {
 public:
  // Takes up what earlier servers have left.
  Studies(Jobs& jobs, std::filesystem::path folder);

  // Calls, from any thread. They throw Refusal.
  v1::Study create(const Caller& caller, const v1::CreateStudyRequest& request);
  v1::Study get(const std::string& id);  // with errors and front, as far as the runs have come
  v1::ListStudiesResponse list();        // without these
  v1::Study cancel(const Caller& caller, const std::string& id);
  std::uint64_t remove(const Caller& caller, const std::string& id, bool with_jobs);  // bytes that are free again

  // Submits runs that are missing, stops those whose intervals are narrow enough, ends studies. From one thread.
  void advance();
  bool is_idle();
  std::set<std::string> jobs();  // of all studies: runs, packings, and what they reuse

 private:
  struct Run {  // what is known of a run that has ended; it does not change any more
    std::optional<v1::StudyCost> cost;
    std::vector<Measured> quantities;
  };
  struct Kept {
    v1::StudySpec spec;                // the whole, with every point's case
    v1::Study study;                   // the specification in it has no cases: as it is told
    std::map<std::string, Run> ended;  // by job
  };

  std::filesystem::path folder_of(const std::string& id) const { return folder_ / id; }
  Kept& kept(const std::string& id);
  Kept& own_kept(const Caller& caller, const std::string& id);  // of a study that the caller may act on
  void store(const Kept& kept) const;
  std::optional<v1::Study> earlier_answer(const Caller& caller, const v1::CreateStudyRequest& request) const;

  void advance(Kept& kept);
  bool pack(Kept& kept);  // true: the packing is there, or none is wanted
  void submit(Kept& kept, int point);
  void look_at(Kept& kept, int point);
  std::optional<std::string> done_before(const v1::Case& value, std::uint32_t ranks, const std::string& packing_job);
  std::string create_job(const v1::Study& study, const std::string& name, v1::Case value, const std::string& packing_job);
  Run results_of(Kept& kept, const v1::StudyRun& run);

  Jobs& jobs_;
  const std::filesystem::path folder_;
  std::mutex mutex_;  // over all below
  std::map<std::string, Kept> studies_;
  StatisticsLogs statistics_;
};

}  // namespace bedflow::server
