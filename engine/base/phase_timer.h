// Wall seconds per phase of a step. Exclusive: a phase entered inside another stops the outer one's clock. The clock that is read
// at every change of phase, several times a sub-step, also tells when a sign of life is due.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string_view>
#include <utility>

namespace bedflow {

enum class Phase {
  pairs,        // building and rebuilding the pair list, sorting
  contacts,     // contact forces between particles
  walls,        // contact forces on walls
  integration,  // velocities and positions
  migration,    // particles that change rank, ghosts of a sub-step
  deposit,      // particles to grid
  sample,       // grid to particles
  momentum,     // gas velocity
  pressure,     // gas pressure correction
  halo,         // ghost cells of fields
  balance,      // moving the cuts between blocks
  statistics,
  checkpoint,
  output,  // events, plot files
  other,
};
inline constexpr int phase_count = 15;
inline constexpr std::array<std::string_view, phase_count> phase_names = {
    "pairs",    "contacts", "walls",   "integration", "migration",  "deposit", "sample", "momentum",
    "pressure", "halo",     "balance", "statistics",  "checkpoint", "output",  "other"};

class PhaseTimer {
 public:
  struct Total {
    double seconds = 0;
    std::uint64_t calls = 0;
    std::uint64_t work = 0;  // units done: particle sub-steps, cell steps, bytes; see summary.json
  };

  class Scope {
   public:
    Scope(PhaseTimer& timer, Phase phase, std::uint64_t work = 0) : timer_(timer), outer_(timer.current_) {
      timer.switch_to(phase);
      Total& total = timer.totals_[static_cast<int>(phase)];
      ++total.calls;
      total.work += work;
    }
    ~Scope() { timer_.switch_to(outer_); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    PhaseTimer& timer_;
    Phase outer_;
  };

  const Total& operator[](Phase phase) const { return totals_[static_cast<int>(phase)]; }
  void restart() {
    totals_ = {};
    start_ = since_ = Clock::now();
  }
  // Called about twice a second from now on, at a change of phase: while the ranks advance, and not while they do not.
  void set_pulse(std::function<void()> pulse) {
    pulse_ = std::move(pulse);
    next_pulse_ = Clock::now();
  }
  // Seconds since construction or the last restart, all phases together.
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  void switch_to(Phase next) {
    const auto now = Clock::now();
    totals_[static_cast<int>(current_)].seconds += std::chrono::duration<double>(now - since_).count();
    since_ = now;
    current_ = next;
    if (now >= next_pulse_) give_pulse(now);
  }
  void give_pulse(Clock::time_point now) {
    next_pulse_ = now + std::chrono::milliseconds(500);
    pulse_();
  }

  std::array<Total, phase_count> totals_{};
  Clock::time_point start_ = Clock::now();
  Clock::time_point since_ = start_;
  Phase current_ = Phase::other;
  Clock::time_point next_pulse_ = Clock::time_point::max();
  std::function<void()> pulse_;
};

}  // namespace bedflow
