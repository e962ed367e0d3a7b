#include "watch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "terminal.h"

namespace bedflow::client {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class Watch {
 public:
  Watch(const Connection& connection, const std::string& id, const WatchPlan& plan, const WatchCalls& calls, Interrupt& interrupt)
      : connection_(connection),
        plan_(plan),
        calls_(calls),
        interrupt_(interrupt),
        sequence_(plan.after_sequence),
        from_now_(plan.from_now) {
    job_.set_id(id);
  }

  WatchResult follow() {
    while (true) {
      const auto status = read_stream();
      if (end_) return {*end_, job_, sequence_};
      if (stop_) return {*stop_, job_, sequence_};
      if (status.ok() && final_) return {WatchEnd::job_final, job_, sequence_};
      if (!status.ok() && !may_come_back(status)) throw connection_.failure_of(status);
      wait_to_reconnect(status);
      if (stop_) return {*stop_, job_, sequence_};
    }
  }

 private:
  static bool may_come_back(const grpc::Status& status) {
    return status.error_code() == grpc::UNAVAILABLE || status.error_code() == grpc::CANCELLED ||
           status.error_code() == grpc::INTERNAL || status.error_code() == grpc::UNKNOWN;
  }

  // One stream, until it ends or what was waited for has come.
  grpc::Status read_stream() {
    v1::WatchJobRequest request;
    request.set_id(job_.id());
    if (sequence_ > 0) request.set_after_sequence(sequence_);
    if (from_now_ && sequence_ == 0) request.set_from_now(true);
    grpc::ClientContext context;
    std::atomic<bool> done = false;
    std::jthread guard([&] {  // a read blocks: interrupt and timeout cancel it from here
      while (!done) {
        if (check_stop(50)) return context.TryCancel();
      }
    });
    const auto reader = connection_.stub().WatchJob(&context, request);
    v1::WatchJobResponse response;
    while (!end_ && reader->Read(&response)) take(response);
    if (end_) context.TryCancel();
    auto status = reader->Finish();
    done = true;
    guard.join();
    return status;
  }

  void take(const v1::WatchJobResponse& response) {
    if (away_since_) calls_.note("connected again");
    away_since_.reset();
    heard_ = true;
    wait_ms_ = 100;
    if (response.has_event() && response.event().has_sequence() && response.event().sequence() <= sequence_)
      return;  // seen before
    if (response.has_job()) {
      job_ = response.job();
      if (!target_) target_ = job_.last_sequence();
    }
    sequence_ = std::max(sequence_, response.has_event() ? response.event().sequence() : response.sequence());
    if (from_now_ && target_) sequence_ = std::max(sequence_, *target_);
    calls_.take(response);
    const bool all_seen = response.bookmark() || sequence_ >= job_.last_sequence();
    if (plan_.until_caught_up && (response.bookmark() || (target_ && sequence_ >= *target_))) end_ = WatchEnd::caught_up;
    if (response.has_job() || final_) final_ = is_final(job_.state());
    if (final_ && all_seen) end_ = WatchEnd::job_final;
    if (plan_.until_state && job_.state() == *plan_.until_state) end_ = WatchEnd::state_reached;
  }

  bool check_stop(long milliseconds) {
    if (interrupt_.wait(milliseconds)) stop_ = WatchEnd::interrupted;
    if (plan_.timeout_seconds && seconds_since(start_) > *plan_.timeout_seconds) stop_ = WatchEnd::timed_out;
    return stop_.has_value();
  }

  void wait_to_reconnect(const grpc::Status& status) {
    if (!status.ok() && !away_since_) {
      away_since_ = Clock::now();
      wait_ms_ = 100;
      if (!heard_) throw connection_.failure_of(status);
      calls_.note("the connection to the server is lost (" + status.error_message() + "); the job is not touched; trying for " +
                  duration_text(plan_.away_seconds));
    }
    if (away_since_ && seconds_since(*away_since_) > plan_.away_seconds) {
      throw Failure(Exit::unreachable,
                    "the server at " + connection_.address() + " stayed away for " + duration_text(plan_.away_seconds),
                    "start it again, then: bedflow watch " + job_.id() + " --after " + std::to_string(sequence_));
    }
    calls_.lost();
    check_stop(wait_ms_);
    wait_ms_ = std::min<long>(2 * wait_ms_, 2000);
  }

  const Connection& connection_;
  const WatchPlan& plan_;
  const WatchCalls& calls_;
  Interrupt& interrupt_;
  const Clock::time_point start_ = Clock::now();
  v1::Job job_;
  std::uint64_t sequence_;
  bool from_now_;
  bool final_ = false;
  bool heard_ = false;
  std::optional<std::uint64_t> target_;
  std::optional<WatchEnd> end_;
  std::optional<WatchEnd> stop_;  // set by the guard, read after it has joined
  std::optional<Clock::time_point> away_since_;
  long wait_ms_ = 100;
};

}  // namespace

WatchResult watch_job(const Connection& connection, const std::string& id, const WatchPlan& plan, const WatchCalls& calls,
                      Interrupt& interrupt) {
  return Watch(connection, id, plan, calls, interrupt).follow();
}

}  // namespace bedflow::client
