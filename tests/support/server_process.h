// A real bedflowd on a private socket in a temporary folder, for tests of the service.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bedflow/v1/service.grpc.pb.h"

namespace bedflow::test {

// A folder under the system's temporary folder; removed with its owner.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

class ServerProcess {
 public:
  // Starts `program --data data --engine engine arguments...` and waits until it listens. Throws std::runtime_error.
  ServerProcess(std::string program, std::filesystem::path data, std::filesystem::path engine,
                std::vector<std::string> arguments = {});
  ~ServerProcess();  // SIGTERM; then what is left of the attempts is killed
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  v1::JobService::Stub& stub() { return *stub_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  const std::string& address() const { return address_; }
  pid_t pid() const { return pid_; }
  std::filesystem::path folder(const std::string& job) const { return data_ / "jobs" / job; }

  void kill();   // SIGKILL, waited for
  void start();  // again, on the same folder
  int stop();    // SIGTERM; the exit code

  // Processes of a job's newest attempt: the runner and what it has started.
  std::vector<pid_t> attempt_processes(const std::string& job) const;
  pid_t runner(const std::string& job) const;                // 0: none yet
  std::vector<pid_t> engines(const std::string& job) const;  // of those, the ones that run the engine's program itself

 private:
  std::string program_;
  std::filesystem::path data_;
  std::filesystem::path engine_;
  std::vector<std::string> arguments_;
  std::string address_;
  pid_t pid_ = -1;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::JobService::Stub> stub_;
};

// True as soon as it holds; false when it does not within the limit.
bool holds_within(std::chrono::milliseconds limit, const std::function<bool()>& condition);

// Every job that the server lists, page by page, newest first. Throws std::runtime_error when a page is refused.
std::vector<v1::Job> all_jobs(v1::JobService::Stub& stub);

v1::ErrorDetail detail_of(const grpc::Status& status);

// All that a watcher is told behind `after`, until `until` says so, the stream ends or the deadline is over.
std::vector<v1::WatchJobResponse> watch(v1::JobService::Stub& stub, const std::string& job, std::uint64_t after,
                                        const std::function<bool(const v1::WatchJobResponse&)>& until,
                                        std::chrono::seconds limit = std::chrono::seconds(30));

// Waits, by a watch, until the job is in the state or final.
v1::Job wait_for_state(v1::JobService::Stub& stub, const std::string& job, v1::JobState state,
                       std::chrono::seconds limit = std::chrono::seconds(30));

}  // namespace bedflow::test
