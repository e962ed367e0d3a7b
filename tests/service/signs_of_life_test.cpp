// The real engine gives signs of life while it lives, whatever it does; and ends when there is nowhere left to write to.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstdlib>
#include <future>

#include "attempt.h"
#include "real_engine_fixture.h"

namespace bedflow::test {
namespace {

using namespace std::chrono_literals;

constexpr double limit_seconds = 2;  // of silence, after which the server gives an engine up
const std::vector<std::string> short_patience = {"--heartbeat-seconds", "2"};

// Wall seconds from the start of the first attempt to its end.
double attempt_seconds(const std::vector<v1::WatchJobResponse>& told) {
  std::int64_t begin = 0, end = 0;
  for (const auto& response : told) {
    if (response.event().has_started()) begin = response.event().unix_nanos();
    if (response.event().has_stopped()) end = response.event().unix_nanos();
  }
  return 1e-9 * static_cast<double>(end - begin);
}

class LongStep : public RealEngine {
 protected:
  LongStep() : RealEngine(short_patience) {}
};

TEST_F(LongStep, IsNotTakenForDeath) {
  auto request = bed(1, 1.5);
  auto& scene = *request.mutable_case_();
  scene.clear_gas();  // particles alone: as many sub-steps in a step as wished
  scene.clear_coupling();
  scene.mutable_domain()->mutable_faces()->clear_y_low();
  scene.mutable_domain()->mutable_faces()->clear_y_high();
  scene.mutable_time()->set_step(1.5);
  const auto id = submit(request);
  const auto told = watch(
      stub(), id, 0, [](const auto& one) { return one.job().state() == v1::SUCCEEDED || one.job().state() == v1::FAILED; },
      limit);
  EXPECT_EQ(told.back().job().state(), v1::SUCCEEDED) << told.back().job().message() << logs(id);
  EXPECT_EQ(told.back().job().epoch(), 1u) << logs(id);
  EXPECT_EQ(told.back().job().progress().step(), 1u);
  EXPECT_GT(attempt_seconds(told), 1.5 * limit_seconds) << "the step was too short to try anything";
}

// The preloaded library lets the first fsync of a checkpoint take this long.
struct SlowDisk {
  SlowDisk() {
    ::setenv("LD_PRELOAD", BEDFLOW_SLOW_FSYNC, 1);
    ::setenv("BEDFLOW_SLOW_FSYNC_SECONDS", "5", 1);
  }
  ~SlowDisk() { ::unsetenv("LD_PRELOAD"); }
};
class LongWrite : private SlowDisk, public RealEngine {
 protected:
  LongWrite() : RealEngine(short_patience) {}
};

TEST_F(LongWrite, IsNotTakenForDeath) {
  const auto id = submit(bed(2, 0.002));
  const auto told = watch(
      stub(), id, 0, [](const auto& one) { return one.job().state() == v1::SUCCEEDED || one.job().state() == v1::FAILED; },
      limit);
  EXPECT_EQ(told.back().job().state(), v1::SUCCEEDED) << told.back().job().message() << logs(id);
  EXPECT_EQ(told.back().job().epoch(), 1u) << logs(id);
  EXPECT_GT(attempt_seconds(told), 5.0) << "the write was not slow";
}

class RemovedFolder : public testing::TestWithParam<int> {};

TEST_P(RemovedFolder, EndsTheEngineByThatName) {
  const int ranks = GetParam();
  const EngineJob job(bed(static_cast<std::uint32_t>(ranks), 1000));
  std::filesystem::create_directories(job.folder.attempt(1));
  std::vector<std::string> command = {BEDFLOW_BIN_DIR "/bedflow-engine", job.folder.root(), "--epoch", "1"};
  for (const char* name : {"OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_mpi_yield_when_idle"})
    ::setenv(name, "1", 1);
  if (ranks > 1) command.insert(command.begin(), {"mpirun", "--oversubscribe", "--bind-to", "none", "-n", std::to_string(ranks)});
  auto engine = std::async(std::launch::async, [&] { return server::ask(command, 60s, 1 << 20); });
  ASSERT_TRUE(holds_within(30s, [&] { return !job.folder.checkpoint_steps().empty(); }));
  const auto begin = std::chrono::steady_clock::now();
  const auto away = job.folder.root().string() + ".away";  // at one stroke, as the server does it
  std::filesystem::rename(job.folder.root(), away);
  std::filesystem::remove_all(away);
  const auto answer = engine.get();
  EXPECT_EQ(answer.exit_code, v1::FOLDER_REMOVED) << answer.error;
  EXPECT_THAT(answer.error, testing::HasSubstr("has been removed"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 20s);
  EXPECT_FALSE(std::filesystem::exists(job.folder.root())) << "the engine has made it again";
}

INSTANTIATE_TEST_SUITE_P(Ranks, RemovedFolder, testing::Values(1, 2), testing::PrintToStringParamName());

TEST(Heartbeat, ChangesInItsContentNotOnlyInItsTime) {
  const EngineJob job(bed(1, 1000));
  const pid_t engine = job.start(1);
  const auto content = [&] { return server::read_text(job.folder.heartbeat()); };
  EXPECT_TRUE(holds_within(30s, [&] { return !content().empty(); }));
  const auto before = content();
  EXPECT_TRUE(holds_within(10s, [&] { return content() != before; }));
  EXPECT_EQ(content().size(), before.size());
  ::kill(engine, SIGKILL);
  server::wait_for_exit(engine);
}

}  // namespace
}  // namespace bedflow::test
