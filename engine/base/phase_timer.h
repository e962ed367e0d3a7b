// Wall seconds per phase of a step. Exclusive: a phase entered inside another stops the outer one's clock.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string_view>

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
  // Seconds since construction, all phases together.
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  void switch_to(Phase next) {
    const auto now = Clock::now();
    totals_[static_cast<int>(current_)].seconds += std::chrono::duration<double>(now - since_).count();
    since_ = now;
    current_ = next;
  }

  std::array<Total, phase_count> totals_{};
  Clock::time_point start_ = Clock::now();
  Clock::time_point since_ = start_;
  Phase current_ = Phase::other;
};

}  // namespace bedflow
