// Ctrl-C, SIGTERM and a terminal that goes away (SIGHUP) as a question to ask, so that a watch can end in order.
#pragma once

#include <csignal>

namespace bedflow::client {

// Made before any other thread starts: blocks these signals for this thread and those that come after. A child does not
// inherit it (child.h).
class Interrupt {
 public:
  Interrupt() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &signals_, &before_);
  }
  ~Interrupt() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  // Waits so long for a signal; true once one has come, and from then on. One thread asks at a time.
  bool wait(long milliseconds) {
    const timespec time = {milliseconds / 1000, milliseconds % 1000 * 1'000'000};
    if (!raised_ && sigtimedwait(&signals_, nullptr, &time) > 0) raised_ = true;
    return raised_;
  }

 private:
  sigset_t signals_{}, before_{};
  bool raised_ = false;
};

}  // namespace bedflow::client
