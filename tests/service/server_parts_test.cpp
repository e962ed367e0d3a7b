// The server's parts by themselves: addresses, names, states, catalogue, folders.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "catalogue.h"
#include "folder.h"
#include "process.h"
#include "refusal.h"
#include "security.h"
#include "service.h"
#include "states.h"
#include "submission.h"
#include "support/server_process.h"

namespace bedflow::server {
namespace {

using test::TemporaryFolder;

std::string refusal_of(const std::string& address) {
  try {
    return "accepted as " + listen_address(address);
  } catch (const std::invalid_argument& wrong) {
    return wrong.what();
  }
}

TEST(Address, LoopbackIsAccepted) {
  EXPECT_EQ(listen_address("127.0.0.1:4000"), "127.0.0.1:4000");
  EXPECT_EQ(listen_address("127.3.2.1:4000"), "127.3.2.1:4000");
  EXPECT_EQ(listen_address("[::1]:4000"), "[::1]:4000");
  EXPECT_EQ(listen_address("localhost:4000"), "127.0.0.1:4000");  // by no resolver
}

TEST(Address, OthersThanLoopbackAreRefusedWithTheReason) {
  for (const char* address : {"0.0.0.0:4000", "[::]:4000", "192.168.1.5:4000", "example.org:4000", "127.0.0.1.example.org:4000",
                              "127.1:4000", "127.0.0.256:4000", ":4000"}) {
    EXPECT_THAT(refusal_of(address), testing::HasSubstr("without TLS and authentication")) << address;
  }
}

TEST(Address, NonsenseIsRefused) {
  for (const char* address : {"", "4000", "127.0.0.1", "127.0.0.1:", "127.0.0.1:99999", "127.0.0.1:4000x"}) {
    EXPECT_THAT(refusal_of(address), testing::HasSubstr("is not an address")) << address;
  }
}

TEST(Address, ASocketInAFolderOpenToOthersIsRefused) {
  const TemporaryFolder folder;
  const auto open = folder.path() / "open";
  std::filesystem::create_directory(open);
  std::filesystem::permissions(open, static_cast<std::filesystem::perms>(0755));
  EXPECT_THAT(refusal_of("unix:" + (open / "s").string()), testing::HasSubstr("open to others"));
  make_private(open);
  EXPECT_EQ(refusal_of("unix:" + (open / "s").string()), "accepted as unix:" + (open / "s").string());
}

TEST(Address, ASocketPathTooLongForTheSystemIsRefused) {
  EXPECT_THAT(refusal_of("unix:/tmp/" + std::string(200, 'x')), testing::HasSubstr("too long"));
}

TEST(Names, HostileIdsAreRefused) {
  EXPECT_TRUE(is_job_id("j-0123456789ab"));
  EXPECT_TRUE(is_job_id(new_job_id()));
  for (const std::string id :
       {"", "j-", "j-0123456789a", "j-0123456789aB", "j-0123456789abc", "../../etc/pass", "j-01234567/../"}) {
    EXPECT_FALSE(is_job_id(id)) << id;
  }
  EXPECT_FALSE(is_job_id(std::string("j-0123456789a\0", 14)));
  EXPECT_TRUE(is_request_id("Retry-0001"));
  EXPECT_FALSE(is_request_id("short"));
  EXPECT_FALSE(is_request_id("has space 1"));
  EXPECT_FALSE(is_request_id(std::string(65, 'a')));
}

TEST(Names, UnprintableBytesAreShownEscapedAndShort) {
  EXPECT_EQ(printable(std::string("a\0\x1b\xff", 4)), "a\\x00\\x1b\\xff");
  EXPECT_EQ(printable(std::string(100, 'a')).size(), 83u);
}

TEST(States, EveryRequestIsAllowedRefusedOrAlreadyObeyed) {
  using v1::JobState;
  const auto unknown = v1::STATE_UNKNOWN;
  struct Row {
    JobState now, cancel, suspend, resume, checkpoint;
  };
  for (const Row& row : {Row{v1::PENDING, v1::STATE_CANCELLED, v1::STATE_SUSPENDED, unknown, unknown},
                         Row{v1::STARTING, v1::CANCELLING, v1::SUSPENDING, unknown, unknown},
                         Row{v1::RUNNING, v1::CANCELLING, v1::SUSPENDING, unknown, v1::RUNNING},
                         Row{v1::SUCCEEDED, unknown, unknown, unknown, unknown},
                         Row{v1::SUSPENDING, v1::CANCELLING, v1::SUSPENDING, unknown, unknown},
                         Row{v1::STATE_SUSPENDED, v1::STATE_CANCELLED, v1::STATE_SUSPENDED, v1::PENDING, unknown},
                         Row{v1::CANCELLING, v1::CANCELLING, unknown, unknown, unknown},
                         Row{v1::STATE_CANCELLED, v1::STATE_CANCELLED, unknown, unknown, unknown},
                         Row{v1::RECOVERING, v1::STATE_CANCELLED, v1::STATE_SUSPENDED, unknown, unknown},
                         Row{v1::FAILED, unknown, unknown, v1::PENDING, unknown}}) {
    EXPECT_EQ(after_request(row.now, Request::cancel), row.cancel) << state_word(row.now);
    EXPECT_EQ(after_request(row.now, Request::suspend), row.suspend) << state_word(row.now);
    EXPECT_EQ(after_request(row.now, Request::resume), row.resume) << state_word(row.now);
    EXPECT_EQ(after_request(row.now, Request::checkpoint), row.checkpoint) << state_word(row.now);
  }
}

TEST(States, OnlyWhatIsNotTheCasesFaultIsRetried) {
  for (const auto reason : {v1::RANK_DIED, v1::HEARTBEAT_LOST, v1::NODE_LOST, v1::BACKEND_ERROR, v1::INTERNAL}) {
    EXPECT_EQ(after_attempt(v1::RUNNING, reason, true), v1::RECOVERING) << reason;
    EXPECT_EQ(after_attempt(v1::RUNNING, reason, false), v1::FAILED) << reason;
    EXPECT_EQ(after_attempt(v1::CANCELLING, reason, true), v1::STATE_CANCELLED) << reason;
    EXPECT_EQ(after_attempt(v1::SUSPENDING, reason, true), v1::STATE_SUSPENDED) << reason;
  }
  for (const auto reason : {v1::INVALID_CASE, v1::DIVERGED, v1::NOT_CONVERGED, v1::PARTICLE_LOST, v1::OUT_OF_MEMORY,
                            v1::WALL_LIMIT, v1::CHECKPOINT_CORRUPT}) {
    EXPECT_EQ(after_attempt(v1::RUNNING, reason, true), v1::FAILED) << reason;
  }
  EXPECT_EQ(after_attempt(v1::RUNNING, v1::DISK_FULL, true), v1::STATE_SUSPENDED);
}

TEST(Catalogue, KeepsJobsAndRequestsOverAReopening) {
  const TemporaryFolder folder;
  JobRecord record;
  record.job.set_id("j-000000000001");
  record.job.set_state(v1::PENDING);
  record.from_step = 7;
  Catalogue(folder.path() / "c").insert(record, "request-1", std::string("a\0b", 3));
  Catalogue again(folder.path() / "c");
  const auto found = again.find("j-000000000001");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->number, record.number);
  EXPECT_EQ(found->from_step, 7u);
  ASSERT_TRUE(again.find_request("request-1"));
  EXPECT_EQ(again.find_request("request-1")->content, std::string("a\0b", 3));
  EXPECT_FALSE(again.find("j-000000000002"));
  EXPECT_FALSE(again.find_request("request-2"));
}

TEST(Catalogue, TheRequestIdOfADeletedJobIsRememberedForThirtyDays) {
  const TemporaryFolder folder;
  JobRecord record, other;
  record.job.set_id("j-000000000001");
  other.job.set_id("j-000000000002");
  constexpr std::int64_t deleted = 1'000'000, month = 30 * 86'400;
  {
    Catalogue catalogue(folder.path() / "c");
    catalogue.insert(record, "request-1", "a");
    catalogue.insert(other, "request-2", "b");
    catalogue.erase("j-000000000001", deleted);
  }
  Catalogue catalogue(folder.path() / "c");
  ASSERT_TRUE(catalogue.find_request("request-1"));
  EXPECT_EQ(catalogue.find_request("request-1")->job, "j-000000000001");
  EXPECT_EQ(catalogue.find_request("request-1")->deleted, deleted);
  EXPECT_FALSE(catalogue.find("j-000000000001"));
  catalogue.erase("j-000000000003", deleted + month);  // no such job
  EXPECT_TRUE(catalogue.find_request("request-1"));
  catalogue.erase("j-000000000002", deleted + month + 1);
  EXPECT_FALSE(catalogue.find_request("request-1"));
  EXPECT_TRUE(catalogue.find_request("request-2"));
}

TEST(Catalogue, ARequestIdThatIsTakenLeavesNoJobBehind) {
  const TemporaryFolder folder;
  Catalogue catalogue(folder.path() / "c");
  JobRecord first, second;
  first.job.set_id("j-000000000001");
  second.job.set_id("j-000000000002");
  catalogue.insert(first, "request-1", "a");
  EXPECT_THROW(catalogue.insert(second, "request-1", "b"), std::runtime_error);
  EXPECT_FALSE(catalogue.find("j-000000000002"));
}

TEST(Folder, ReplacingAFileLeavesNothingBesideIt) {
  const TemporaryFolder folder;
  write_durably(folder.path() / "x", "first");
  write_durably(folder.path() / "x", "second");
  EXPECT_EQ(read_text(folder.path() / "x"), "second");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
  EXPECT_THROW(write_durably(folder.path() / "no" / "x", "y"), std::system_error);
}

TEST(Folder, CheckpointsAreFoundByNameAloneNewestFirst) {
  const TemporaryFolder folder;
  const JobFolder job(folder.path());
  std::filesystem::create_directory(job.checkpoints());
  for (const char* name : {"checkpoint_0000000002.h5", "checkpoint_0000000010.h5", "checkpoint_0000000011.h5.partial",
                           "checkpoint_.h5", "checkpoint_-000000001.h5", "notes.h5"}) {
    std::ofstream(job.checkpoints() / name) << "x";
  }
  EXPECT_THAT(job.checkpoint_steps(), testing::ElementsAre(10, 2));
}

TEST(Folder, EachCommandHasAHigherNumber) {
  const TemporaryFolder folder;
  const JobFolder job(folder.path());
  v1::Control control;
  for (const std::uint64_t number : {1, 2, 3}) {
    job.command(v1::Control::CHECKPOINT);
    ASSERT_TRUE(read_message(job.control(), control));
    EXPECT_EQ(control.sequence(), number);
  }
}

TEST(Process, AnAnswerIsTakenWithItsExitCode) {
  const auto answer = ask({"sh", "-c", "echo out; echo err >&2; exit 10"}, std::chrono::seconds(10), 1000);
  EXPECT_EQ(answer.exit_code, 10);
  EXPECT_EQ(answer.output, "out\n");
  EXPECT_EQ(answer.error, "err\n");
  EXPECT_FALSE(answer.timed_out);
}

TEST(Process, OneThatDoesNotEndIsKilledAtTheLimit) {
  EXPECT_TRUE(ask({"sleep", "60"}, std::chrono::milliseconds(50), 1000).timed_out);
  EXPECT_TRUE(ask({"sh", "-c", "exec >&- 2>&-; exec sleep 60"}, std::chrono::milliseconds(50), 1000).timed_out);  // silent too
}

TEST(Process, OneThatSaysTooMuchIsKilled) {
  const auto answer = ask({"yes"}, std::chrono::seconds(20), 100'000);
  EXPECT_EQ(answer.exit_code, 128 + 9);
  EXPECT_LT(answer.output.size(), 1'000'000u);
}

// A process may end between the opening and the reading of its files, which then fails.
TEST(Process, OnesThatEndWhileTheyAreLookedAtAreGone) {
  for (int round = 0; round < 20; ++round) {
    std::vector<pid_t> children(20);
    for (pid_t& child : children) child = server::launch({.command = {"true"}, .environment = {}});
    std::jthread reaper([&] {
      for (const pid_t child : children) server::wait_for_exit(child);
    });
    const pid_t last = children.back();
    while (server::start_ticks(last)) {
      for (const pid_t child : children) EXPECT_TRUE(server::command_line(child).find("false") == std::string::npos);
      EXPECT_TRUE(server::session_members(last).empty());
    }
  }
}

TEST(Submission, TheSpecificationsFaultsAreAllNamed) {
  v1::JobSpec spec;
  spec.set_ranks(9);
  spec.set_executor("moon");
  spec.set_wall_limit_seconds(-1);
  spec.mutable_checkpoints()->set_keep(1);
  spec.mutable_checkpoints()->set_every_wall_seconds(std::numeric_limits<double>::quiet_NaN());
  (*spec.mutable_labels())["Bad Key"] = "x";
  std::vector<std::string> paths;
  spec.set_priority(1001);
  const Capacities executors = {{"local", {8, 8, 0}}};
  for (const auto& fault : check_spec(spec, executors)) paths.push_back(fault.path());
  EXPECT_THAT(paths,
              testing::UnorderedElementsAre("spec.ranks", "spec.executor", "spec.priority", "spec.wall_limit_seconds",
                                            "spec.checkpoints.keep", "spec.checkpoints.every_wall_seconds", "spec.labels"));
  EXPECT_TRUE(check_spec(v1::JobSpec(), executors).empty());
}

TEST(Refusal, FaultsBeyondWhatHeadersHoldAreCounted) {
  std::vector<v1::Fault> faults(1000);
  for (auto& fault : faults) fault.set_text(std::string(100, 'x'));
  const auto detail = test::detail_of(status_of({Refused::invalid_case, "faults", "", faults}));
  EXPECT_LT(detail.ByteSizeLong(), 5000u);  // gRPC's headers hold 8 KiB
  const auto shown = detail.faults_size() - 1;
  EXPECT_GT(shown, 10);
  EXPECT_EQ(detail.faults(shown).text(), "and " + std::to_string(1000 - shown) + " more");
}

}  // namespace
}  // namespace bedflow::server
