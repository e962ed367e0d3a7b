#include "retention.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <filesystem>

#include "record_log.h"
#include "refusal.h"

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

bool is_at_rest(const v1::Job& job) {
  return is_final(job.state()) || job.state() == v1::STATE_SUSPENDED;
}

bool can_be_resumed(const v1::Job& job, const JobFolder& folder) {
  return after_request(job.state(), Request::resume) != v1::STATE_UNKNOWN && !folder.checkpoint_steps().empty();
}

std::string steps_text(const std::vector<std::uint64_t>& steps) {
  std::string text;
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) text += (text.empty() ? "" : ", ") + std::to_string(*step);
  return text;
}

}  // namespace

void Retention::round(const std::vector<v1::Job>& jobs, const std::set<std::string>& in_use) {
  for (const auto& job : jobs) {
    if (!is_at_rest(job) || job.pinned()) continue;
    try {
      if (policy_.job_life && !in_use.contains(job.id()) && is_over(job)) {
        const auto freed = jobs_.remove(Caller(), job.id());
        ++removed_.jobs;
        removed_.bytes += freed;
        spdlog::info("{} was removed by retention: it had ended, and {:.3g} days are over", job.id(),
                     policy_.job_life->count() / 86400);
      } else if (policy_.checkpoints > 0) {
        thin(job);
      }
    } catch (const std::exception& failure) {  // resumed or deleted meanwhile, a full disk, a reader without time
      spdlog::warn("retention leaves {} as it is: {}", job.id(), failure.what());
    }
  }
}

bool Retention::is_over(const v1::Job& job) {
  if (!is_final(job.state())) return false;
  const auto age = std::chrono::nanoseconds(now_nanos() - job.changed_unix_nanos());
  if (age < *policy_.job_life) return false;
  const JobFolder folder = jobs_.folder(job.id());
  return folder.pinned_steps().empty() && !can_be_resumed(job, folder);
}

std::optional<std::uint64_t> Retention::newest_good(const JobFolder& folder, const std::vector<std::uint64_t>& steps) {
  for (const auto step : steps) {
    if (readers_.verify(folder.checkpoint(step)).empty()) return step;
  }
  return std::nullopt;
}

// The newest stay by name; of the others those that are pinned, that the job's own policy keeps, or that is the newest good one.
void Retention::thin(const v1::Job& job) {
  const std::string key = job.id() + " " + std::to_string(job.changed_unix_nanos());
  if (thinned_.contains(key)) return;
  const JobFolder folder = jobs_.folder(job.id());
  const auto steps = folder.checkpoint_steps(), pinned = folder.pinned_steps();
  std::vector<std::uint64_t> extra(steps.begin() + std::min<std::ptrdiff_t>(policy_.checkpoints, std::ssize(steps)), steps.end());
  std::erase_if(extra, [&](std::uint64_t step) {
    return fs::exists(folder.kept_mark(step)) || std::find(pinned.begin(), pinned.end(), step) != pinned.end();
  });
  if (!extra.empty()) {
    const auto good = newest_good(folder, steps);
    if (good) std::erase(extra, *good);
    if (!good) {
      spdlog::warn("retention leaves the checkpoints of {} alone: none of them is good", job.id());
      extra.clear();
    }
  }
  const auto removed = jobs_.remove_checkpoints(job, extra);
  removed_.checkpoints += removed.checkpoints;
  removed_.bytes += removed.bytes;
  thinned_.insert(key);
}

// ------------------------------------------------------------------------------------------------ of the jobs themselves

RemovedCheckpoints Jobs::remove_checkpoints(const v1::Job& seen, const std::vector<std::uint64_t>& steps) {
  const std::string& id = seen.id();
  const JobFolder folder = folder_of(id);
  std::vector<fs::path> away;
  RemovedCheckpoints removed;
  const auto take_away = [&](const fs::path& file) {
    std::error_code gone;
    const bool is_last_name = fs::hard_link_count(file, gone) == 1;
    const auto bytes = fs::file_size(file, gone);
    if (gone) return;
    const fs::path target = settings_.data / "removed" / (id + "-" + file.filename().string());
    fs::rename(file, target);
    away.push_back(target);
    ++removed.checkpoints;
    if (is_last_name) removed.bytes += bytes;
  };
  {
    const std::lock_guard guard(mutex_);
    const JobRecord record = record_of(id);
    if (live_.contains(id) || record.job.changed_unix_nanos() != seen.changed_unix_nanos())
      throw Refusal(Refused::wrong_state, "it is no longer " + std::string(state_word(seen.state())));
    fs::create_directories(settings_.data / "removed");
    for (const auto step : steps) take_away(folder.checkpoint(step));
    std::error_code none;
    std::vector<fs::path> left;  // by resumes from earlier ones
    for (const auto& entry : fs::directory_iterator(folder.checkpoints(), none)) {
      if (entry.path().filename().string().find(".superseded-") != std::string::npos) left.push_back(entry.path());
    }
    for (const auto& file : left) take_away(file);
    if (away.empty()) return removed;
    sync_folder(folder.checkpoints());
    const std::string of_steps = steps.empty() ? "" : " of steps " + steps_text(steps);
    const std::string and_left = left.empty() ? ""
                                              : std::string(steps.empty() ? "" : " and") + " " + std::to_string(left.size()) +
                                                    " that a resume from an earlier one had left behind";
    tell(record, "retention removed the checkpoints" + of_steps + and_left);
  }
  for (const auto& file : away) fs::remove(file);
  spdlog::info("{}: retention removed {} checkpoints", id, removed.checkpoints);
  return removed;
}

// Into the event log of a job that no engine runs.
void Jobs::tell(JobRecord record, const std::string& text) {
  LogWriter log(folder_of(record.job.id()).events());
  v1::Event event;
  event.set_sequence(log.next_sequence());
  event.set_epoch(record.job.epoch());
  event.set_unix_nanos(now_nanos());
  event.mutable_log()->set_severity(v1::LogLine::INFO);
  event.mutable_log()->set_text(text);
  log.append(static_cast<std::uint32_t>(event.what_case()), event.SerializeAsString());
  log.sync();
  record.job.set_last_sequence(event.sequence());
  catalogue_.update(record);
  if (const auto watched = feeds_.find(record.job.id()); watched != feeds_.end()) {
    if (const auto feed = watched->second.lock()) feed->add(std::make_shared<const v1::Event>(event));
  }
  news_.insert(record.job.id());
  notifier_.poke();
}

}  // namespace bedflow::server
