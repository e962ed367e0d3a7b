#include "study_follow.h"

#include <chrono>
#include <cmath>

#include "terminal.h"

namespace bedflow::client {

using namespace std::chrono_literals;

std::string progress_of(const v1::Study& study) {
  int ended = 0, running = 0;
  std::string now, suspended;
  for (int i = 0; i < study.runs_size(); ++i) {
    const auto& run = study.runs(i);
    if (has_ended(run)) ++ended;
    if (run.state() == v1::STATE_SUSPENDED && !run.interval_met()) suspended += " " + run.job();
    if (run.state() != v1::RUNNING || run.interval_met()) continue;
    if (running++ < 3)
      now += (now.empty() ? "; now " : ", ") + point_name(study.spec(), i) + " at " + number_text(std::round(100 * run.done())) +
             " %";
  }
  if (running > 3) now += " and " + std::to_string(running - 3) + " more";
  if (ended == 0 && running == 0 && study.has_packing_job()) now = "; the particles are being packed";
  if (!suspended.empty()) now += "; suspended, resume to go on:" + suspended;
  return std::to_string(ended) + " of " + std::to_string(study.runs_size()) + " runs have ended" + now;
}

v1::Study get_study(const Connection& connection, const std::string& id) {
  v1::GetStudyRequest request;
  request.set_id(id);
  return connection.call(&Stub::GetStudy, request, 60);
}

std::optional<v1::Study> follow_study(const Connection& connection, const std::string& id, Interrupt& interrupt,
                                      EmbeddedServer* own) {
  const Terminal terminal(stderr);
  std::string last;
  auto said = std::chrono::steady_clock::time_point();
  int lost = 0;
  do {
    std::optional<v1::Study> study;
    try {
      study = get_study(connection, id);
      lost = 0;
    } catch (const Failure& failure) {
      if (failure.code != Exit::unreachable || ++lost > 30) throw;
      if (own) own->revive();
    }
    if (study && study->state() != v1::STUDY_RUNNING) {
      if (terminal.interactive()) std::fputs("\r\x1b[K", stderr);
      if (!last.empty()) say(progress_of(*study));  // a log that tells of the way tells of the end
      return study;
    }
    const auto now = std::chrono::steady_clock::now();
    const std::string line = study ? progress_of(*study) : "the server does not answer; trying again";
    if (terminal.interactive()) {
      std::fputs(("\r\x1b[K" + line.substr(0, static_cast<std::size_t>(std::max(20, terminal.width() - 1)))).c_str(), stderr);
    } else if (line != last && now - said > 10s) {
      say(line);
      last = line;
      said = now;
    }
  } while (!interrupt.wait(1000));
  return std::nullopt;
}

}  // namespace bedflow::client
