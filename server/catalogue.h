// The catalogue of jobs: SQLite, write-ahead log, synchronous=FULL. What is here when a call returns is there after a crash.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bedflow/v1/service.pb.h"
#include "caller.h"

struct sqlite3;

namespace bedflow::server {

struct JobRecord {
  v1::Job job;
  std::int64_t number = 0;                 // in the order of submission, from 1
  std::uint32_t retries = 0;               // used since the job was created or resumed by a user
  std::optional<std::uint64_t> from_step;  // checkpoint that the next attempt must take up
};

// Not thread-safe. Any failure throws std::runtime_error with SQLite's words; a full disk std::system_error (ENOSPC).
class Catalogue {
 public:
  explicit Catalogue(const std::filesystem::path& file);
  ~Catalogue();
  Catalogue(const Catalogue&) = delete;
  Catalogue& operator=(const Catalogue&) = delete;

  struct Request {
    std::string job;
    std::string content;       // what was asked: a CreateJobRequest, serialized deterministically
    std::int64_t deleted = 0;  // seconds of Unix; 0: the job is there
  };
  // Of a job that is there, or was deleted less than `remembered` ago: a late retry shall not run it again.
  std::optional<Request> find_request(const std::string& request_id) const;
  static constexpr std::chrono::hours remembered{30 * 24};
  // Job, with its owner, and what was asked in one transaction; request_id may be empty. Gives the record its number.
  void insert(JobRecord& record, const std::string& request_id, const std::string& content);
  std::string content(const JobRecord& record) const;  // empty: created before content was kept for every job
  void update(const JobRecord& record);
  // deleted: when, in seconds of Unix; what was deleted longer ago than is remembered is forgotten then. Nothing if there is no
  // such job.
  void erase(const std::string& id, std::int64_t deleted);

  std::optional<JobRecord> find(const std::string& id) const;
  std::vector<JobRecord> in_states(const std::vector<v1::JobState>& states, std::int64_t most = -1) const;  // oldest first
  // Newest first, numbers below `below`, any state if none is named, anybody's if no owner is.
  std::vector<JobRecord> page(std::int64_t below, const std::vector<v1::JobState>& states, std::int64_t most,
                              const std::string& owner = {}) const;
  std::int64_t count(const std::vector<v1::JobState>& states, const std::string& owner = {}) const;
  std::int64_t count_of(const std::string& owner) const;  // all jobs if empty
  std::map<v1::JobState, std::uint64_t> counts() const;
  // All of it as it is now, into a new file: for a backup, while servers go on writing.
  static void copy(const std::filesystem::path& from, const std::filesystem::path& to);

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  std::unique_ptr<sqlite3, Close> database_;
};

}  // namespace bedflow::server
