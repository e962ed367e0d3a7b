// Many watchers, slow and frozen ones among them, and many jobs.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <thread>

#include "process.h"
#include "service_fixture.h"
#include "support/trials.h"
#include "watchers.h"

namespace bedflow::test {
namespace {

using namespace std::chrono_literals;

// A line of /proc/<pid>/status, in KiB.
std::size_t kibibytes(pid_t process, const std::string& name) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(name + ":")) return std::stoul(line.substr(name.size() + 1));
  }
  return 0;
}

// One slot, and a job in it that does nothing until it is cancelled.
class Crowd : public ServiceTest {
 protected:
  explicit Crowd(std::vector<std::string> arguments = {"--slots", "1", "--heartbeat-seconds", "3600"})
      : ServiceTest(std::move(arguments)) {}

  void occupy() {
    blocker_ = submit(job_of(2, "freeze_at=1"));
    ASSERT_EQ(wait_for(blocker_, v1::RUNNING).state(), v1::RUNNING);
  }
  void free_the_slot() {
    ASSERT_TRUE(cancel(blocker_).ok());
    for (const pid_t engine : server_.engines(blocker_)) ::kill(engine, SIGKILL);
  }

  std::string blocker_;
};

TEST_F(Crowd, AReaderThatLagsIsSparedTheProgressThatIsOvertakenAndNothingElse) {
  occupy();
  const auto id = submit(job_of(20'000, "step_ms=0"));
  Watching slow(server_.address(), id, 1, 1);
  ASSERT_TRUE(slow.have_begun(20s));
  free_the_slot();
  ASSERT_EQ(wait_for_state(stub(), id, v1::SUCCEEDED, 100s).state(), v1::SUCCEEDED);
  TestWatcher& watcher = *slow.all()[0];
  watcher.thaw();
  ASSERT_TRUE(watcher.has_ended(60s));
  EXPECT_THAT(watcher.states(), testing::ElementsAre(v1::PENDING, v1::STARTING, v1::RUNNING, v1::SUCCEEDED));
  EXPECT_TRUE(watcher.is_gapless());
  EXPECT_EQ(watcher.last(), job(id).last_sequence());
  EXPECT_GT(watcher.merged(), 5000u);       // far more than its window of 64 KiB holds
  EXPECT_EQ(watcher.checkpoints(), 2001u);  // every 10 steps and at the end
}

TEST_F(Crowd, FrozenWatchersHoldNobodyUpAndCostLittleMemory) {
  const auto watchers = static_cast<std::size_t>(trials(200, 1000));
  occupy();
  const auto id = submit(job_of(200, "step_ms=10"));
  Watching watching(server_.address(), id, watchers, watchers / 10);
  ASSERT_TRUE(watching.have_begun(60s));
  free_the_slot();
  EXPECT_EQ(watching.ended(120s), watchers - watchers / 10);
  for (std::size_t i = watchers / 10; i < watchers; ++i) {
    const TestWatcher& watcher = *watching.all()[i];
    EXPECT_THAT(watcher.states(), testing::ElementsAre(v1::PENDING, v1::STARTING, v1::RUNNING, v1::SUCCEEDED));
    EXPECT_TRUE(watcher.is_gapless());
    EXPECT_EQ(watcher.checkpoints(), 21u);
  }
  const auto memory = kibibytes(server_.pid(), "VmHWM") / 1024;
  EXPECT_LT(memory, 200u);
  std::cout << watchers << " watchers, " << memory << " MiB at most\n";
}

TEST_F(Crowd, AClientThatIsStoppedIsLetGo) {
  if (!std::getenv("BEDFLOW_LONG")) GTEST_SKIP() << "takes the server's keepalive of 30 + 20 s; ctest -L long runs it";
  occupy();
  const auto descriptors = [&] {
    const std::filesystem::directory_iterator all("/proc/" + std::to_string(server_.pid()) + "/fd");
    return std::distance(begin(all), end(all));
  };
  const auto before = descriptors();
  const std::string program = BEDFLOW_BIN_DIR "/bedflow";
  const pid_t client =
      server::launch({.command = {program, "watch", blocker_, "--server", server_.address()}, .environment = {}});
  ASSERT_TRUE(holds_within(20s, [&] { return descriptors() > before; }));
  ::kill(client, SIGSTOP);
  EXPECT_TRUE(holds_within(90s, [&] { return descriptors() == before; }));
  ::kill(client, SIGKILL);
  server::wait_for_exit(client);
}

TEST_F(Crowd, JobsOfManyClientsAreListedOnceEachWhileMoreArrive) {
  constexpr int clients = 16;
  const int count = trials(320, 10'000);
  occupy();
  std::mutex mutex;
  std::set<std::string> acknowledged = {blocker_};
  std::vector<std::thread> threads;
  threads.reserve(clients);
  for (int client = 0; client < clients; ++client) {
    threads.emplace_back([&, client] {
      for (int i = client; i < count; i += clients) {
        const auto id = submit(job_of(1));
        const std::lock_guard guard(mutex);
        acknowledged.insert(id);
      }
    });
  }
  const auto list = [&](std::uint32_t page_size) {
    std::vector<std::string> listed;
    v1::ListJobsRequest request;
    request.set_page_size(page_size);
    do {
      v1::ListJobsResponse page;
      EXPECT_TRUE(call(&v1::JobService::Stub::ListJobs, request, page).ok());
      for (const auto& job : page.jobs()) listed.push_back(job.id());
      request.set_page_token(page.next_page_token());
    } while (!request.page_token().empty());
    return listed;
  };
  int rounds = 0;
  for (std::size_t known = 0; known < static_cast<std::size_t>(count); ++rounds) {
    std::set<std::string> before;
    {
      const std::lock_guard guard(mutex);
      before = acknowledged;
    }
    known = before.size();
    const auto listed = list(37);
    const std::set<std::string> distinct(listed.begin(), listed.end());
    ASSERT_EQ(distinct.size(), listed.size()) << "a job was listed twice";
    ASSERT_TRUE(std::includes(distinct.begin(), distinct.end(), before.begin(), before.end())) << "a job was not listed";
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(list(1000).size(), static_cast<std::size_t>(count) + 1);
  std::cout << count << " jobs, listed " << rounds << " times while they came\n";
}

}  // namespace
}  // namespace bedflow::test
