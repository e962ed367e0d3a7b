// A disk that is full: for checkpoints, logs and the catalogue. Small file systems of their own, where they can be mounted.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/mount.h>
#include <unistd.h>

#include <filesystem>
#include <set>

#include "real_engine_fixture.h"
#include "service_fixture.h"
#include "support/trials.h"

namespace bedflow::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

// A file system in memory, of so many MiB.
class SmallDisk {
 public:
  explicit SmallDisk(int mebibytes) : path(folder_.path() / "disk") {
    fs::create_directories(path);
    mounted_ = ::mount("tmpfs", path.c_str(), "tmpfs", 0, ("size=" + std::to_string(mebibytes) + "m").c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(path.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  bool is_mounted() const { return mounted_; }
  // Takes all that is free.
  void fill() const {
    const int file = ::open((path / "filler").c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    const std::string block(4096, 'x');
    while (::write(file, block.data(), block.size()) > 0) {
    }
    ::close(file);
  }
  void make_room() const { fs::remove(path / "filler"); }

 private:
  TemporaryFolder folder_;
  bool mounted_ = false;

 public:
  const fs::path path;
};

// There before the server is, and still when it has gone.
struct DiskHolder {
  SmallDisk disk{64};
};

class RealFullDisk : private DiskHolder, public RealEngine {
 protected:
  RealFullDisk() : RealEngine({}, disk.path / "data") {}
  void SetUp() override {
    if (!disk.is_mounted()) GTEST_SKIP() << "a small file system cannot be mounted here (that takes root)";
  }
  using DiskHolder::disk;

  static v1::CreateJobRequest checkpointed_bed(v1::CheckpointPolicy::FullDisk policy, double end) {
    auto request = bed(1, end);
    auto& checkpoints = *request.mutable_spec()->mutable_checkpoints();
    checkpoints.set_every_simulated_seconds(0.002);
    checkpoints.set_when_disk_full(policy);
    return request;
  }
  std::string statistics_of_an_undisturbed_run(double end) {
    const auto id = submit(checkpointed_bed(v1::CheckpointPolicy::SUSPEND, end));
    EXPECT_EQ(wait_for(id, v1::SUCCEEDED).state(), v1::SUCCEEDED) << logs(id);
    return statistics(id).series(0).SerializeAsString();
  }
  // The first is of step 0.
  void wait_for_second_checkpoint(const std::string& id) {
    watch(
        stub(), id, 0, [](const auto& one) { return one.event().checkpoint().step() > 0; }, limit);
  }
};

TEST_F(RealFullDisk, SuspendsTheRunByItsNameAndItGoesOnWithTheSameBits) {
  const auto expected = statistics_of_an_undisturbed_run(0.06);
  const auto id = submit(checkpointed_bed(v1::CheckpointPolicy::SUSPEND, 0.06));
  wait_for_second_checkpoint(id);
  disk.fill();
  const auto stopped = wait_for(id, v1::STATE_SUSPENDED);
  ASSERT_EQ(stopped.state(), v1::STATE_SUSPENDED) << stopped.message() << logs(id);
  EXPECT_EQ(stopped.reason(), v1::DISK_FULL) << stopped.message();
  EXPECT_EQ(stopped.epoch(), 1u) << "it was tried again on the full disk";
  disk.make_room();
  grpc::ClientContext context;
  v1::ResumeJobRequest resume;
  resume.set_id(id);
  v1::Job answer;
  ASSERT_TRUE(stub().ResumeJob(&context, resume, &answer).ok());
  const auto done = wait_for(id, v1::SUCCEEDED);
  EXPECT_EQ(done.state(), v1::SUCCEEDED) << done.message() << logs(id);
  EXPECT_EQ(statistics(id).series(0).SerializeAsString(), expected);
}

TEST_F(RealFullDisk, LetsTheRunGoOnWhereThePolicySaysSoAndNothingItReportsIsMissing) {
  const auto expected = statistics_of_an_undisturbed_run(0.3);
  const auto id = submit(checkpointed_bed(v1::CheckpointPolicy::GO_ON, 0.3));
  wait_for_second_checkpoint(id);
  disk.fill();
  const server::JobFolder folder(server_.folder(id));
  const auto filled = fs::last_write_time(folder.heartbeat());
  ASSERT_TRUE(holds_within(20s, [&] { return fs::last_write_time(folder.heartbeat()) > filled + 200ms; })) << logs(id);
  disk.make_room();
  const auto done = wait_for(id, v1::SUCCEEDED);
  EXPECT_EQ(done.state(), v1::SUCCEEDED) << done.message() << logs(id);
  EXPECT_EQ(done.epoch(), 1u);
  EXPECT_EQ(statistics(id).series(0).SerializeAsString(), expected);
  std::string warnings;
  std::uint64_t sequence = 0;
  for (const auto& response : watch(
           stub(), id, 0, [](const auto&) { return false; }, limit)) {
    if (!response.has_event()) continue;
    EXPECT_EQ(response.event().sequence(), ++sequence);
    if (response.event().log().severity() == v1::LogLine::WARNING) warnings += response.event().log().text() + "\n";
  }
  EXPECT_THAT(warnings, testing::HasSubstr("no checkpoint of step"));
}

TEST_F(RealFullDisk, ThatFillsUpInTheMiddleOfAWriteNeverEndsTheEngine) {
  auto request = checkpointed_bed(v1::CheckpointPolicy::GO_ON, 1000);
  request.mutable_spec()->mutable_checkpoints()->clear_every_simulated_seconds();
  request.mutable_spec()->mutable_checkpoints()->set_every_steps(1);
  const auto id = submit(request);
  wait_for_second_checkpoint(id);
  const auto engines = server_.engines(id);
  const server::JobFolder folder(server_.folder(id));
  const auto beats = [&] { return fs::last_write_time(folder.heartbeat()); };
  for (int i = trials(10, 100); i > 0; --i) {
    disk.fill();
    const auto filled = beats();
    ASSERT_TRUE(holds_within(20s, [&] { return beats() > filled; }));
    disk.make_room();
    const auto free = beats();
    ASSERT_TRUE(holds_within(20s, [&] { return beats() > free; }));
  }
  EXPECT_EQ(server_.engines(id), engines);
  v1::Job answer;
  grpc::ClientContext context;
  v1::SuspendJobRequest suspend;
  suspend.set_id(id);
  ASSERT_TRUE(stub().SuspendJob(&context, suspend, &answer).ok());
  const auto done = wait_for(id, v1::STATE_SUSPENDED);
  EXPECT_EQ(done.reason(), v1::SUSPENDED) << done.ShortDebugString() << logs(id);
  EXPECT_EQ(done.epoch(), 1u);
}

class FullDisk : private DiskHolder, public testing::Test {
 protected:
  void SetUp() override {
    if (!disk.is_mounted()) GTEST_SKIP() << "a small file system cannot be mounted here (that takes root)";
  }
  grpc::Status submit(const v1::CreateJobRequest& request) {
    grpc::ClientContext context;
    v1::CreateJobResponse response;
    auto status = server_.stub().CreateJob(&context, request, &response);
    if (status.ok()) acknowledged_.insert(response.job().id());
    return status;
  }
  std::set<std::string> listed() {
    std::set<std::string> ids;
    for (const auto& job : all_jobs(server_.stub())) ids.insert(job.id());
    return ids;
  }
  using DiskHolder::disk;
  std::set<std::string> acknowledged_;
  ServerProcess server_{server_program, disk.path / "data", BEDFLOW_FAKE_ENGINE, {"--slots", "1", "--heartbeat-seconds", "3600"}};
};

TEST_F(FullDisk, RefusesSubmissionsByNameAndLosesNoneThatWasAcknowledged) {
  ASSERT_TRUE(submit(job_of(2, "freeze_at=1")).ok());  // takes the slot
  ASSERT_EQ(wait_for_state(server_.stub(), *acknowledged_.begin(), v1::RUNNING).state(), v1::RUNNING);
  disk.fill();
  auto request = job_of(1);
  auto& labels = *request.mutable_spec()->mutable_labels();
  for (int i = 0; i < 60; ++i) labels["label-" + std::to_string(i)] = std::string(250, 'x');
  grpc::Status status;
  for (int i = 0; i < 2000 && status.ok(); ++i) status = submit(request);
  expect_refused(status, grpc::StatusCode::RESOURCE_EXHAUSTED, "DISK_FULL");
  EXPECT_GT(acknowledged_.size(), 1u);
  EXPECT_EQ(listed(), acknowledged_) << "while the disk is full";
  server_.kill();
  server_.start();  // on the full disk
  EXPECT_EQ(listed(), acknowledged_) << "after a new start on the full disk";
  disk.make_room();
  EXPECT_TRUE(submit(request).ok());
  EXPECT_EQ(listed(), acknowledged_);
}

}  // namespace
}  // namespace bedflow::test
