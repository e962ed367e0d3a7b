// Series of a job, whether it runs or not: asked for, or told as they grow.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "bedflow/v1/service.pb.h"
#include "folder.h"
#include "statistics_file.h"

namespace bedflow::server {

// Logs that were asked about are kept as they stand, the ones asked for last within a bound of memory: a question then costs what
// is new in the log. Throws Refusal: series_not_found with the names there are, bad_request, log_damaged.
class StatisticsLogs {
 public:
  v1::Statistics query(const JobFolder& folder, const v1::QueryStatisticsRequest& request);
  v1::ListSeriesResponse list(const JobFolder& folder, const std::string& id);

 private:
  struct Kept {
    explicit Kept(const std::filesystem::path& path) : log(path) {}
    std::mutex mutex;
    StatisticsLog log;
    std::size_t bytes = 0;
    std::list<std::string>::iterator place;
  };
  template <class Ask>
  auto ask(const JobFolder& folder, const std::string& id, Ask ask);
  std::shared_ptr<Kept> kept(const JobFolder& folder, const std::string& id);
  void drop_oldest();

  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Kept>> logs_;
  std::list<std::string> asked_;  // newest first
};

// The records of one job's log, in order, for one follower.
class StatisticsFollower {
 public:
  StatisticsFollower(const JobFolder& folder, const v1::StreamStatisticsRequest& request);
  // What is new, so much as fits into one answer; false if there is nothing.
  bool next(v1::StreamStatisticsResponse& answer);
  std::uint64_t record() const { return record_; }

 private:
  void take(const LogRecord& framed, v1::StreamStatisticsResponse& answer);
  bool is_wanted(const v1::StatisticsRecord& record) const;

  const v1::StreamStatisticsRequest request_;
  LogReader reader_;
  std::uint64_t record_;
  std::vector<bool> wanted_;  // a monitor
};

}  // namespace bedflow::server
