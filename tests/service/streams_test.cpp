// WatchJob: first message, history, resume tokens, bookmarks, the end of a stream.
#include <gmock/gmock.h>

#include <chrono>
#include <future>
#include <thread>

#include "folder.h"
#include "service_fixture.h"

namespace bedflow::test {
namespace {

using grpc::StatusCode;

class Streams : public ServiceTest {
 protected:
  explicit Streams(std::vector<std::string> arguments = {}) : ServiceTest(std::move(arguments)) {}

  grpc::Status status_of_watch(const std::string& id, std::uint64_t after) {
    grpc::ClientContext context;
    v1::WatchJobRequest request;
    request.set_id(id);
    request.set_after_sequence(after);
    const auto reader = stub().WatchJob(&context, request);
    v1::WatchJobResponse response;
    while (reader->Read(&response)) {
    }
    return reader->Finish();
  }
};

TEST_F(Streams, TheFirstMessageIsTheJobAndComesAtOnce) {
  const auto id = submit(job_of(1000, "step_ms=20"));
  const auto start = std::chrono::steady_clock::now();
  const auto told = watch(stub(), id, 0, [](const auto&) { return true; });
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].job().id(), id);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));  // 0.1 s promised; the test machine may be busy
}

TEST_F(Streams, StatesComeInOrderBehindTheEventsThatMadeThem) {
  auto filler = job_of(1000, "step_ms=5");
  filler.mutable_spec()->set_ranks(4);  // all slots: the watched job waits until the watch has begun
  v1::ServerInfo info;
  ASSERT_TRUE(call(&v1::JobService::Stub::GetServerInfo, v1::GetServerInfoRequest(), info).ok());
  filler.mutable_spec()->set_ranks(info.slots());
  const auto first = submit(filler);
  wait_for(first, v1::RUNNING);
  const auto id = submit(job_of(10));
  std::vector<v1::JobState> states;
  bool stopped = false, stopped_before_success = false;
  watch(stub(), id, 0, [&](const v1::WatchJobResponse& response) {
    if (response.has_job()) {
      if (states.empty()) cancel(first);
      states.push_back(response.job().state());
      stopped_before_success = stopped;
    }
    stopped = stopped || response.event().has_stopped();
    return false;
  });
  EXPECT_THAT(states, testing::ElementsAre(v1::PENDING, v1::STARTING, v1::RUNNING, v1::SUCCEEDED));
  EXPECT_TRUE(stopped_before_success);
}

TEST_F(Streams, TheStreamOfAFinalJobReplaysItsHistoryAndEnds) {
  const auto id = submit(job_of(10));
  wait_for(id, v1::SUCCEEDED);
  std::uint64_t expected = 0;
  for (const auto& response : watch(stub(), id, 0, [](const auto&) { return false; })) {
    if (!response.has_event()) continue;
    EXPECT_EQ(response.event().sequence(), ++expected);
  }
  EXPECT_EQ(expected, job(id).last_sequence());
  EXPECT_TRUE(status_of_watch(id, 0).ok());
}

TEST_F(Streams, ALongHistoryIsReplayedWholeFromAnyToken) {
  const auto id = submit(job_of(2000, "step_ms=0"));
  wait_for(id, v1::SUCCEEDED);
  const auto last = job(id).last_sequence();
  ASSERT_GT(last, 2000u);
  for (const std::uint64_t after : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1000}, last - 1, last}) {
    std::uint64_t expected = after;
    for (const auto& response : watch(stub(), id, after, [](const auto&) { return false; })) {
      if (!response.has_event()) continue;
      ASSERT_EQ(response.event().sequence(), ++expected);
    }
    EXPECT_EQ(expected, last);
  }
}

TEST_F(Streams, FromNowGivesNoHistory) {
  const auto id = submit(job_of(100, "step_ms=5"));
  ASSERT_TRUE(has_reached(id, 10));
  const auto seen = job(id).last_sequence();
  grpc::ClientContext context;
  v1::WatchJobRequest request;
  request.set_id(id);
  request.set_from_now(true);
  const auto reader = stub().WatchJob(&context, request);
  v1::WatchJobResponse response;
  while (reader->Read(&response) && !response.has_event()) {
  }
  EXPECT_GT(response.event().sequence(), seen);
  context.TryCancel();
  reader->Finish();
}

TEST_F(Streams, ATokenFromTheFutureIsRefused) {
  const auto id = submit(job_of(1));
  wait_for(id, v1::SUCCEEDED);
  expect_refused(status_of_watch(id, 1'000'000), StatusCode::INVALID_ARGUMENT, "BAD_REQUEST");
  expect_refused(status_of_watch("j-000000000000", 0), StatusCode::NOT_FOUND, "JOB_NOT_FOUND");
}

TEST_F(Streams, WatchersThatReadNothingHoldNobodyUp) {
  const auto id = submit(job_of(200, "step_ms=2"));
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::WatchJobResponse>>> frozen;
  v1::WatchJobRequest request;
  request.set_id(id);
  for (int i = 0; i < 50; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    frozen.push_back(stub().WatchJob(contexts.back().get(), request));
  }
  EXPECT_EQ(wait_for(id, v1::SUCCEEDED).state(), v1::SUCCEEDED);
  for (auto& context : contexts) context->TryCancel();
  for (auto& reader : frozen) {
    v1::WatchJobResponse response;
    while (reader->Read(&response)) {
    }
    reader->Finish();
  }
}

TEST_F(Streams, AServerThatGoesDownEndsItsStreamsWithTheToken) {
  const auto id = submit(job_of(1000, "step_ms=5"));
  wait_for(id, v1::RUNNING);
  auto ended = std::async(std::launch::async, [&] { return status_of_watch(id, 0); });
  ASSERT_TRUE(has_reached(id, 5));
  EXPECT_EQ(server_.stop(), 0);
  const auto status = ended.get();
  EXPECT_EQ(status.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_THAT(status.error_message(), testing::HasSubstr("after_sequence"));
  EXPECT_EQ(detail_of(status).reason(), "GOING_DOWN");
  EXPECT_GT(detail_of(status).retry_after_seconds(), 0);
}

TEST_F(Streams, AServerThatGoesDownAnswersWhoeverWaitsForACheckpoint) {
  const auto id = submit(job_of(100, "freeze_at=5"));
  ASSERT_TRUE(has_reached(id, 4));
  auto ended = std::async(std::launch::async, [&] {
    v1::CreateCheckpointRequest request;
    request.set_id(id);
    v1::Checkpoint checkpoint;
    return call(&v1::JobService::Stub::CreateCheckpoint, request, checkpoint);
  });
  ASSERT_TRUE(holds_within(std::chrono::seconds(10), [&] {
    v1::Control control;
    return server::read_message(server_.folder(id) / "control.txtpb", control) && control.command() == v1::Control::CHECKPOINT;
  }));
  EXPECT_EQ(server_.stop(), 0);
  expect_refused(ended.get(), StatusCode::UNAVAILABLE, "GOING_DOWN");
}

class QuickBookmarks : public Streams {
 protected:
  QuickBookmarks() : Streams({"--bookmark-seconds", "0.2"}) {}
};

TEST_F(QuickBookmarks, ASilentStreamGetsBookmarksWithItsToken) {
  const auto id = submit(job_of(100, "freeze_at=3"));
  const auto told = watch(stub(), id, 0, [](const v1::WatchJobResponse& response) { return response.bookmark(); });
  ASSERT_TRUE(told.back().bookmark());
  EXPECT_EQ(told.back().sequence(), job(id).last_sequence());
}

}  // namespace
}  // namespace bedflow::test
