#include "queue.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "clock.h"

namespace bedflow::server {
namespace {

constexpr std::ptrdiff_t most_counted = 1000;  // of those ahead

}  // namespace

std::string memory_text(double bytes) {
  const bool is_large = bytes >= 0.95 * (1 << 30);
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), is_large ? "%.1f GiB" : "%.0f MiB",
                std::max(bytes, 0.0) / (is_large ? 1 << 30 : 1 << 20));
  return text.data();
}

double seconds_until(std::int64_t unix_nanos) {
  constexpr double longest_pause = 60;
  const double left = 1e-9 * static_cast<double>(unix_nanos - now_nanos());
  return left > longest_pause ? 0 : std::max(left, 0.0);
}

void Queue::put(const JobRecord& record) {
  take(record.job.id());
  const auto& job = record.job;
  // One whose wall limit was over has had its turn.
  const auto since =
      job.state() == v1::PENDING && job.reason() == v1::WALL_LIMIT ? job.changed_unix_nanos() : job.created_unix_nanos();
  const Place place{-std::int64_t{job.spec().priority()}, since, record.number};
  places_[job.id()] = {job.spec().executor(), place};
  lines_[job.spec().executor()][place] = {job.id(), job.owner(), job.spec().ranks(),
                                          static_cast<double>(job.planned_memory_bytes()),
                                          job.state() == v1::RECOVERING ? job.next_attempt_unix_nanos() : 0};
}

void Queue::take(const std::string& id) {
  const auto found = places_.find(id);
  if (found == places_.end()) return;
  lines_[found->second.first].erase(found->second.second);
  places_.erase(found);
}

std::uint32_t Queue::size_of(const std::string& executor) const {
  const auto line = lines_.find(executor);
  return line == lines_.end() ? 0 : static_cast<std::uint32_t>(line->second.size());
}

// Nothing: it can start.
std::string Queue::lacks(const std::string& executor, const Waiting& job, const Use& use) const {
  const auto capacity = capacities_.find(executor);
  if (capacity == capacities_.end()) return "a server that has the executor " + executor;
  const auto& [at_once, most, memory] = capacity->second;
  std::string text;
  if (at_once > 0 && use.ranks + job.ranks > at_once) {
    const auto free = at_once - std::min(use.ranks, at_once);
    text = std::to_string(job.ranks) + " of " + std::to_string(at_once) + " slots (" + std::to_string(free) +
           (free == 1 ? " is free)" : " are free)");
  }
  if (memory > 0 && job.memory_bytes > 0 && use.memory_bytes + job.memory_bytes > memory) {
    text += (text.empty() ? "" : " and ") + memory_text(job.memory_bytes) + " of memory (" +
            memory_text(memory - use.memory_bytes) + " of " + memory_text(memory) + " are free)";
  }
  return text;
}

std::optional<std::string> Queue::next(const std::map<std::string, Use>& uses, const IsHeld& is_held) const {
  for (const auto& [executor, line] : lines_) {
    const auto use = uses.find(executor);
    for (const auto& [place, job] : line) {
      if (seconds_until(job.not_before) > 0 || is_held(job.owner)) continue;
      if (lacks(executor, job, use == uses.end() ? Use() : use->second).empty()) return job.id;
      break;
    }
  }
  return std::nullopt;
}

std::string Queue::reason(const std::string& id, const std::map<std::string, Use>& uses, const IsHeld& is_held) const {
  const auto found = places_.find(id);
  if (found == places_.end()) return {};
  const std::string& executor = found->second.first;
  const Place& place = found->second.second;
  const Line& line = lines_.at(executor);
  const auto self = line.find(place);
  if (const double pause = seconds_until(self->second.not_before); pause > 0)
    return "the next attempt, in " + std::to_string(static_cast<int>(std::ceil(pause))) + " s";
  const auto use = uses.find(executor);
  const auto lacked = [&](const Waiting& job) { return lacks(executor, job, use == uses.end() ? Use() : use->second); };
  std::ptrdiff_t ahead = 0;
  const Waiting* first = nullptr;
  for (auto other = line.begin(); other != self && ahead < most_counted; ++other) {
    if (seconds_until(other->second.not_before) > 0 || is_held(other->second.owner)) continue;
    if (!first) first = &other->second;
    ++ahead;
  }
  if (!first) return lacked(self->second);
  const std::string what = lacked(*first);
  return (ahead == 1 ? "its turn after " + first->id
                     : "its turn after " + std::to_string(ahead) + (ahead == most_counted ? " or more" : "") + " others, first " +
                           first->id) +
         (what.empty() ? "" : ", which waits for " + what);
}

std::vector<std::string> Queue::first(std::size_t most) const {
  std::vector<std::pair<Place, std::string>> all;
  for (const auto& [executor, line] : lines_) {
    for (auto job = line.begin();
         job != line.end() && job != std::next(line.begin(), static_cast<std::ptrdiff_t>(std::min(most, line.size()))); ++job)
      all.emplace_back(job->first, job->second.id);
  }
  std::sort(all.begin(), all.end());
  std::vector<std::string> ids;
  for (const auto& [place, id] : all) {
    if (ids.size() < most) ids.push_back(id);
  }
  return ids;
}

}  // namespace bedflow::server
