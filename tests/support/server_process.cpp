#include "server_process.h"

#include <fcntl.h>
#include <google/protobuf/text_format.h>
#include <grpcpp/grpcpp.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>
#include <utility>

#include "folder.h"
#include "process.h"

namespace bedflow::test {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "bedflow-XXXXXX").string();
  if (!::mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

ServerProcess::ServerProcess(std::string program, fs::path data, fs::path engine, std::vector<std::string> arguments)
    : program_(std::move(program)), data_(std::move(data)), engine_(std::move(engine)), arguments_(std::move(arguments)) {
  start();
}

ServerProcess::~ServerProcess() {
  stop();
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(data_ / "jobs", missing)) {
    for (const pid_t process : attempt_processes(entry.path().filename())) ::kill(process, SIGKILL);
  }
}

void ServerProcess::start() {
  std::array<int, 2> output;
  if (::pipe2(output.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe");
  const fs::path log = data_.string() + ".log";
  const int error = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  std::vector<std::string> command = {program_, "--data", data_, "--engine", engine_};
  command.insert(command.end(), arguments_.begin(), arguments_.end());
  pid_ = server::launch({.command = command, .environment = {}, .output = output[1], .error = error});
  ::close(output[1]);
  ::close(error);
  std::string said;
  pollfd pipe{output[0], POLLIN, 0};
  std::array<char, 256> buffer;
  while (said.find('\n') == std::string::npos && ::poll(&pipe, 1, 20'000) > 0) {
    const auto got = ::read(output[0], buffer.data(), buffer.size());
    if (got <= 0) break;
    said.append(buffer.data(), static_cast<std::size_t>(got));
  }
  ::close(output[0]);
  const std::string word = "listening on ";
  if (!said.starts_with(word)) throw std::runtime_error("bedflowd did not come up: " + server::read_text(log));
  address_ = said.substr(word.size(), said.find('\n') - word.size());
  grpc::ChannelArguments settings;
  settings.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // a new server is not held to the old one's connection
  channel_ = grpc::CreateCustomChannel(address_, grpc::InsecureChannelCredentials(), settings);
  stub_ = v1::JobService::NewStub(channel_);
}

void ServerProcess::kill() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGKILL);
  server::wait_for_exit(std::exchange(pid_, -1));
}

int ServerProcess::stop() {
  if (pid_ < 0) return -1;
  ::kill(pid_, SIGTERM);
  return server::wait_for_exit(std::exchange(pid_, -1));
}

pid_t ServerProcess::runner(const std::string& job) const {
  const server::JobFolder job_folder(folder(job));
  const auto epochs = job_folder.epochs();
  v1::Runner runner;
  if (epochs.empty() || !server::read_message(job_folder.runner(epochs.back()), runner)) return 0;
  return static_cast<pid_t>(runner.pid());
}

std::vector<pid_t> ServerProcess::attempt_processes(const std::string& job) const {
  const pid_t session = runner(job);
  return session > 0 ? server::session_members(session) : std::vector<pid_t>{};
}

std::vector<pid_t> ServerProcess::engines(const std::string& job) const {
  auto found = attempt_processes(job);
  std::erase_if(found, [&](pid_t process) {
    std::error_code gone;
    return fs::read_symlink("/proc/" + std::to_string(process) + "/exe", gone) != fs::canonical(engine_);
  });
  return found;
}

bool holds_within(std::chrono::milliseconds limit, const std::function<bool()>& condition) {
  const auto deadline = Clock::now() + limit;
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

std::vector<v1::Job> all_jobs(v1::JobService::Stub& stub) {
  std::vector<v1::Job> jobs;
  v1::ListJobsRequest request;
  request.set_page_size(1000);
  do {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
    v1::ListJobsResponse page;
    const auto status = stub.ListJobs(&context, request, &page);
    if (!status.ok()) throw std::runtime_error("the jobs are not listed: " + status.error_message());
    jobs.insert(jobs.end(), page.jobs().begin(), page.jobs().end());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return jobs;
}

v1::ErrorDetail detail_of(const grpc::Status& status) {
  v1::ErrorDetail detail;
  detail.ParseFromString(status.error_details());
  return detail;
}

std::vector<v1::WatchJobResponse> watch(v1::JobService::Stub& stub, const std::string& job, std::uint64_t after,
                                        const std::function<bool(const v1::WatchJobResponse&)>& until,
                                        std::chrono::seconds limit) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + limit);
  v1::WatchJobRequest request;
  request.set_id(job);
  request.set_after_sequence(after);
  const auto reader = stub.WatchJob(&context, request);
  std::vector<v1::WatchJobResponse> told;
  v1::WatchJobResponse response;
  while (reader->Read(&response)) {
    told.push_back(response);
    if (until(response)) break;
  }
  context.TryCancel();
  reader->Finish();
  return told;
}

v1::Job wait_for_state(v1::JobService::Stub& stub, const std::string& job, v1::JobState state, std::chrono::seconds limit) {
  const auto told = watch(
      stub, job, 0, [&](const v1::WatchJobResponse& response) { return response.has_job() && response.job().state() == state; },
      limit);
  for (auto response = told.rbegin(); response != told.rend(); ++response) {
    if (response->has_job()) return response->job();
  }
  return {};
}

}  // namespace bedflow::test
