// A stream of answers that is drawn from a source, one at a time, on a pool's thread: the next is made when the last has been
// taken, so a slow client costs no memory. One that takes nothing for a minute is let go.
#pragma once

#include <grpcpp/grpcpp.h>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

namespace bedflow::server {

enum class Pulled { answer, nothing_yet, end };

template <class Response>
class PullStream final : public grpc::ServerWriteReactor<Response>, public std::enable_shared_from_this<PullStream<Response>> {
 public:
  using Source = std::function<Pulled(Response&)>;  // may throw
  using StatusOf = std::function<grpc::Status(const std::exception&)>;

  // gRPC owns what this returns, until it is done with it. done: called then.
  static PullStream* open(boost::asio::thread_pool& pool, grpc::CallbackServerContext* context, Source source, StatusOf status_of,
                          std::function<void()> done) {
    auto stream = std::make_shared<PullStream>(pool, context, std::move(source), std::move(status_of), std::move(done));
    stream->self_ = stream;
    stream->go_on();
    return stream.get();
  }

  PullStream(boost::asio::thread_pool& pool, grpc::CallbackServerContext* context, Source source, StatusOf status_of,
             std::function<void()> done)
      : pool_(pool),
        context_(context),
        source_(std::move(source)),
        status_of_(std::move(status_of)),
        done_(std::move(done)),
        timer_(pool) {}

  void OnWriteDone(bool ok) override {
    stop_timer();
    if (!ok) gone_ = true;
    go_on();
  }
  void OnCancel() override {
    gone_ = true;
    stop_timer();  // a wait for news ends now
  }
  void OnDone() override {
    stop_timer();
    done_();
    self_.reset();
  }

 private:
  static constexpr auto patience = std::chrono::milliseconds(200);  // between two looks for news
  static constexpr auto longest_write = std::chrono::seconds(60);

  void go_on() {
    boost::asio::post(pool_, [self = this->shared_from_this()] { self->pull(); });
  }

  void pull() {
    if (gone_) return this->Finish(grpc::Status::CANCELLED);
    Pulled pulled = Pulled::end;
    response_.Clear();
    try {
      pulled = source_(response_);
    } catch (const std::exception& failure) {
      return this->Finish(status_of_(failure));
    }
    if (pulled == Pulled::end) return this->Finish(grpc::Status::OK);
    if (pulled == Pulled::nothing_yet) return start_timer(patience, &PullStream::go_on);
    start_timer(longest_write, &PullStream::let_go);
    this->StartWrite(&response_);
  }
  void let_go() { context_->TryCancel(); }

  // Waiting for news goes on when it is stopped, too: then() is told of both.
  void start_timer(std::chrono::milliseconds time, void (PullStream::*then)()) {
    const std::lock_guard guard(timer_mutex_);
    timer_.expires_after(gone_ ? std::chrono::milliseconds(0) : time);
    timer_.async_wait([self = this->shared_from_this(), then](const boost::system::error_code& stopped) {
      if (!stopped || then == &PullStream::go_on) (self.get()->*then)();
    });
  }
  void stop_timer() {
    const std::lock_guard guard(timer_mutex_);
    timer_.cancel();
  }

  boost::asio::thread_pool& pool_;
  grpc::CallbackServerContext* const context_;
  const Source source_;
  const StatusOf status_of_;
  const std::function<void()> done_;
  std::mutex timer_mutex_;
  boost::asio::steady_timer timer_;
  std::atomic<bool> gone_ = false;
  Response response_;
  std::shared_ptr<PullStream> self_;
};

}  // namespace bedflow::server
