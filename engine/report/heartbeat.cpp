#include "report/heartbeat.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <utility>

namespace bedflow {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds pause{400};

}  // namespace

Heartbeat::Heartbeat(bool here, std::filesystem::path file, std::uint32_t epoch)
    : file_(std::move(file)), epoch_(epoch), silent_(!here) {}

void Heartbeat::beat() {
  const std::lock_guard guard(mutex_);
  const auto now = Clock::now();
  if (silent_ || now < next_) return;
  next_ = now + pause;
  const int file = open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) return;
  std::array<char, 40> text{};  // always as long, so that nothing of an earlier one stays
  const int size = std::snprintf(text.data(), text.size(), "%10u %20llu\n", epoch_, static_cast<unsigned long long>(++count_));
  // A disk that is full from the start has no room even for this: then the time has to do.
  if (pwrite(file, text.data(), static_cast<std::size_t>(size), 0) < 0) futimens(file, nullptr);
  close(file);
}

void Heartbeat::leave() {
  const std::lock_guard guard(mutex_);
  silent_ = true;
}

Heartbeat::Meanwhile::Meanwhile(Heartbeat& heartbeat, std::chrono::duration<double> most) {
  if (heartbeat.silent_) return;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(most);
  thread_ = std::thread([this, &heartbeat, end] {
    std::unique_lock guard(mutex_);
    while (!over_ && Clock::now() < end) {
      heartbeat.beat();
      changed_.wait_for(guard, pause);
    }
  });
}

Heartbeat::Meanwhile::~Meanwhile() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard guard(mutex_);
    over_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

}  // namespace bedflow
