#include "slurm_executor.h"

#include <spdlog/spdlog.h>

#include <system_error>
#include <utility>

#include "process.h"

namespace bedflow::server {
namespace {

using namespace std::chrono_literals;

constexpr auto longest_answer = 60s;  // of one of Slurm's commands
constexpr auto stillness = 5s;        // of an engine that Slurm no longer knows, after which it is taken for dead

std::string one_line(std::string text) {
  for (char& c : text) c = c == '\n' ? ' ' : c;
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

struct Said {
  bool good = false;
  std::string output, error;
};

Said say(const std::vector<std::string>& command) {
  try {
    const Answer answer = ask(command, longest_answer, 64 << 20);
    if (answer.timed_out) return {false, {}, command.front() + ": Connection timed out"};
    return {answer.exit_code == 0, answer.output, one_line(answer.error)};
  } catch (const std::system_error& failure) {
    return {false, {}, failure.what()};
  }
}

}  // namespace

SlurmExecutor::SlurmExecutor(SlurmSettings settings, Programs programs, std::string server_id, std::function<void()> news)
    : settings_(std::move(settings)),
      programs_(std::move(programs)),
      server_id_(std::move(server_id)),
      news_(std::move(news)),
      thread_([this] { work(); }) {}

SlurmExecutor::~SlurmExecutor() {
  {
    const std::lock_guard guard(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void SlurmExecutor::hurry() {
  hurried_ = true;
  changed_.notify_all();
}

void SlurmExecutor::start(const JobFolder& folder, const AttemptOrder& order) {
  std::filesystem::create_directories(folder.attempt(order.epoch));  // from here on no earlier attempt writes anything
  sync_folder(folder.attempts());
  write_durably(folder.batch_script(order.epoch), batch_script(settings_, programs_, folder, order));
  reserve(folder.runner(order.epoch));  // a disk that fills up later does not keep the runner from saying how it ended
  reserve(folder.exit_record(order.epoch));
  const auto name = batch_name(server_id_, folder, order.epoch);
  const std::lock_guard guard(mutex_);
  tracked_[name].submission = submit_command(settings_, name, folder, order);
  hurry();
}

void SlurmExecutor::kill(const JobFolder& folder, std::uint32_t epoch) {
  const std::lock_guard guard(mutex_);
  if (!std::exchange(tracked_[batch_name(server_id_, folder, epoch)].kill, true)) hurry();
}

void SlurmExecutor::withdraw(const JobFolder& folder, std::uint32_t epoch) {
  const std::lock_guard guard(mutex_);
  if (!std::exchange(tracked_[batch_name(server_id_, folder, epoch)].withdraw, true)) hurry();
}

void SlurmExecutor::forget(const JobFolder& folder, std::uint32_t epoch) {
  const std::lock_guard guard(mutex_);
  tracked_.erase(batch_name(server_id_, folder, epoch));
}

std::string SlurmExecutor::trouble() {
  const std::lock_guard guard(mutex_);
  return trouble_;
}

// ------------------------------------------------------------------------------------------------ what is known

Sighting SlurmExecutor::look(const JobFolder& folder, std::uint32_t epoch, std::chrono::steady_clock::duration silence) {
  const std::lock_guard guard(mutex_);
  const auto [entry, is_new] = tracked_.try_emplace(batch_name(server_id_, folder, epoch));
  if (is_new) hurry();  // of an earlier server
  Tracked& attempt = entry->second;
  Sighting sighting;
  const auto waiting = [&](std::string why) {
    sighting.where = Sighting::Where::waiting;
    sighting.waits_for = std::move(why);
    return sighting;
  };
  if (attempt.refusal) {
    sighting.where = Sighting::Where::gone;
    sighting.ending = attempt.refusal;
    return sighting;
  }
  const std::string reasons = trouble_.empty() ? "" : ": " + trouble_;
  if (!attempt.looked_for) return waiting("an answer of Slurm's" + reasons);
  if (!attempt.submission.empty()) return waiting("Slurm to take it" + reasons);
  if (attempt.seen) {
    sighting.batch_job = attempt.seen->id;
    sighting.node = attempt.seen->node;
  }
  switch (attempt.seen ? stage_of(attempt.seen->state) : SlurmStage::ended) {
    case SlurmStage::queued:
      return waiting("its turn in Slurm's queue (job " + attempt.seen->id + ", " + attempt.seen->reason + ")" + reasons);
    case SlurmStage::runs:
      if (std::filesystem::exists(folder.exit_record(epoch)) && !std::exchange(attempt.hurried, true)) hurry();
      return sighting;
    default:
      return ended(attempt, folder, epoch, silence);
  }
}

Sighting SlurmExecutor::ended(const Tracked& attempt, const JobFolder& folder, std::uint32_t epoch,
                              std::chrono::steady_clock::duration silence) const {
  Sighting sighting;
  if (attempt.seen) {
    sighting.batch_job = attempt.seen->id;
    sighting.node = attempt.seen->node;
  }
  const bool completing = attempt.seen && stage_of(attempt.seen->state) == SlurmStage::completing;
  const bool is_told = std::filesystem::exists(folder.exit_record(epoch));
  const bool has_begun = std::filesystem::exists(folder.runner(epoch));
  if (!completing && attempt.seen) sighting.ending = ending_of(*attempt.seen);
  if (attempt.kill && sighting.ending && sighting.ending->reason == v1::SUSPENDED) sighting.ending.reset();
  if (!has_begun && attempt.withdraw && sighting.ending && sighting.ending->reason == v1::SUSPENDED)
    sighting.ending->message = "taken out of Slurm's queue before it began";
  if (!has_begun && !sighting.ending && !completing) {
    const std::string said = last_lines(folder.error_log(epoch));
    sighting.ending = {v1::BACKEND_ERROR, "Slurm " +
                                              (attempt.seen ? "ended its job " + attempt.seen->id + " as " + attempt.seen->state
                                                            : std::string("does not know the job")) +
                                              " before the engine began" + (said.empty() ? "" : "; its last words: " + said)};
  }
  // An engine that lives on although Slurm says that it has ended: Slurm may have started the job twice, and speaks of the other.
  const bool is_over = sighting.ending || (is_told && !completing) || silence > stillness;
  sighting.where = is_over ? Sighting::Where::gone : Sighting::Where::there;
  return sighting;
}

// --------------------------------------------------------------------------------------------------- the thread

void SlurmExecutor::set_trouble(std::string trouble) {
  const std::lock_guard guard(mutex_);
  if (trouble != trouble_) spdlog::warn("Slurm {}", trouble.empty() ? "answers again" : "does not answer: " + trouble);
  trouble_ = std::move(trouble);
}

std::vector<std::string> SlurmExecutor::names(const std::function<bool(const Tracked&)>& wanted) {
  const std::lock_guard guard(mutex_);
  std::vector<std::string> found;
  for (const auto& [name, attempt] : tracked_) {
    if (wanted(attempt)) found.push_back(name);
  }
  return found;
}

void SlurmExecutor::work() {
  const auto is_to_stop = [](const Tracked& one) {
    return one.seen && !one.told && (one.kill || (one.withdraw && stage_of(one.seen->state) == SlurmStage::queued));
  };
  while (true) {
    {
      std::unique_lock guard(mutex_);
      changed_.wait_for(guard, tracked_.empty() ? 3600s : std::chrono::milliseconds(settings_.poll),
                        [&] { return hurried_ || ending_; });
      if (ending_) return;
      hurried_ = false;
      if (tracked_.empty()) continue;
    }
    if (look_at_queue()) {
      for (const auto& name : names([](const Tracked& one) { return !one.submission.empty() && one.looked_for; })) submit(name);
      for (const auto& name : names(is_to_stop)) stop(name);
    }
    news_();
  }
}

bool SlurmExecutor::look_at_queue() {
  const auto asked = names([](const Tracked&) { return true; });
  const Said said = say(queue_command());
  set_trouble(said.good ? "" : said.error.empty() ? "squeue failed" : said.error);
  if (!said.good) return false;
  std::map<std::string, SlurmJob> there;
  for (auto& job : parse_queue(said.output)) {
    SlurmJob& known = there[job.name];
    if (known.name.empty() || stage_of(job.state) > stage_of(known.state)) known = std::move(job);
  }
  const std::lock_guard guard(mutex_);
  for (const auto& name : asked) {
    const auto attempt = tracked_.find(name);
    if (attempt == tracked_.end()) continue;
    const auto job = there.find(name);
    attempt->second.looked_for = true;
    if (job != there.end()) {
      attempt->second.seen = job->second;
      attempt->second.submission.clear();  // a try whose answer was lost
    } else if (attempt->second.submission.empty() && attempt->second.seen &&
               stage_of(attempt->second.seen->state) != SlurmStage::ended) {
      attempt->second.seen.reset();  // Slurm has forgotten it
    }
  }
  return true;
}

void SlurmExecutor::submit(const std::string& name) {
  std::vector<std::string> command;
  {
    const std::lock_guard guard(mutex_);
    const auto attempt = tracked_.find(name);
    if (attempt == tracked_.end()) return;
    if (attempt->second.withdraw || attempt->second.kill) {
      attempt->second.refusal = {v1::SUSPENDED, "stopped before it was given to Slurm"};
      return;
    }
    command = attempt->second.submission;
  }
  const Said said = say(command);
  const std::string id = said.output.substr(0, said.output.find_first_of(";\n"));
  const std::lock_guard guard(mutex_);
  const auto attempt = tracked_.find(name);
  if (attempt == tracked_.end()) return;
  if (said.good && !id.empty()) {
    spdlog::info("{} is Slurm's job {}", name, id);
    attempt->second.submission.clear();
    attempt->second.seen = SlurmJob{id, "PENDING", "None", {}, name};
  } else if (is_passing(said.error)) {  // it may have been taken all the same: looked for before the next try
    spdlog::warn("{} is submitted again: {}", name, said.error);
    attempt->second.looked_for = false;
  } else {
    attempt->second.refusal = {v1::BACKEND_ERROR, "Slurm does not take the job: " + said.error};
  }
}

void SlurmExecutor::stop(const std::string& name) {
  std::vector<std::string> command = {"scancel"};
  {
    const std::lock_guard guard(mutex_);
    const auto attempt = tracked_.find(name);
    if (attempt == tracked_.end() || !attempt->second.seen) return;
    // One that has begun obeys the control file instead.
    if (!attempt->second.kill) command.emplace_back("--state=PENDING");
    command.push_back(attempt->second.seen->id);
  }
  const Said said = say(command);
  if (!said.good) spdlog::warn("{}: {}", name, said.error);
  const std::lock_guard guard(mutex_);
  const auto attempt = tracked_.find(name);
  if (attempt == tracked_.end()) return;
  attempt->second.told = said.good && attempt->second.kill;  // one that only waits is told until it is gone or has begun
  if (said.good && !std::exchange(attempt->second.hurried, true)) hurried_ = true;
}

}  // namespace bedflow::server
