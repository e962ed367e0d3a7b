// The jobs that wait for this server to start them: the highest priority first, among equals the one that has waited longest.
// Each executor has a line of its own, and in it nobody overtakes the first: a large job waits for room, not for ever.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "catalogue.h"

namespace bedflow::server {

// What an executor can run.
struct Capacity {
  std::uint32_t ranks_at_once = 0;  // 0: it queues by itself
  std::uint32_t most_ranks = 0;     // of one job
  double memory_bytes = 0;          // of all plans together; 0: not counted
};
using Capacities = std::map<std::string, Capacity>;  // by the executor's name

struct Use {
  std::uint32_t ranks = 0, jobs = 0;
  double memory_bytes = 0;
};

// Whether a quota, say, keeps an owner's jobs from starting.
using IsHeld = std::function<bool(const std::string& owner)>;
inline bool nobody_is_held(const std::string&) {
  return false;
}

class Queue {
 public:
  explicit Queue(Capacities capacities) : capacities_(std::move(capacities)) {}

  void put(const JobRecord& record);  // or put it anew
  void take(const std::string& id);
  std::size_t size() const { return places_.size(); }
  bool has(const std::string& id) const { return places_.contains(id); }
  std::uint32_t size_of(const std::string& executor) const;

  // The next that can start now; nothing when the first of each line lacks something.
  // Jobs of an owner that is held are passed over.
  std::optional<std::string> next(const std::map<std::string, Use>& uses, const IsHeld& is_held = nobody_is_held) const;
  // What it waits for, for people: "2 of 4 slots (1 is free)". Empty: nothing, or it does not wait.
  std::string reason(const std::string& id, const std::map<std::string, Use>& uses, const IsHeld& is_held = nobody_is_held) const;
  std::vector<std::string> first(std::size_t most) const;

 private:
  using Place = std::tuple<std::int64_t, std::int64_t, std::int64_t>;  // -priority, waits since, number
  struct Waiting {
    std::string id, owner;
    std::uint32_t ranks = 0;
    double memory_bytes = 0;
    std::int64_t not_before = 0;  // unix nanos
  };
  using Line = std::map<Place, Waiting>;
  std::string lacks(const std::string& executor, const Waiting& job, const Use& use) const;

  Capacities capacities_;
  std::map<std::string, Line> lines_;                            // by executor
  std::map<std::string, std::pair<std::string, Place>> places_;  // by id
};

std::string memory_text(double bytes);  // "900 MiB", "3.1 GiB": as plans tell it

// How long until then, s; a clock that was set back makes nobody wait for longer than any pause is.
double seconds_until(std::int64_t unix_nanos);

}  // namespace bedflow::server
