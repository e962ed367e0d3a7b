#include "reader.h"

#include <signal.h>

#include <algorithm>
#include <cstring>
#include <sstream>

#include "refusal.h"
#include "security.h"

namespace bedflow::server {
namespace {

constexpr std::size_t longest_report = 16 << 20;
constexpr std::size_t longest_part = 4 << 20;      // of an answer; gRPC's default for a message
constexpr std::size_t longest_answer = 1UL << 30;  // all parts
constexpr int wrong_question = 2;

std::string first_lines(const std::string& text) {
  constexpr std::size_t most = 900;
  std::string line = text.substr(0, std::min(text.find_last_not_of('\n') + 1, most));
  std::replace(line.begin(), line.end(), '\n', ';');
  return line;
}

// The reader names the file by its whole path, which is nobody's business.
std::string without_path(std::string text, const std::filesystem::path& file) {
  for (const auto& [path, shown] :
       {std::pair(file.string() + ": ", std::string()), std::pair(file.string(), std::string("the file"))}) {
    for (auto place = text.find(path); place != std::string::npos; place = text.find(path))
      text.replace(place, path.size(), shown);
  }
  return text;
}

std::vector<v1::Fault> faults_of(const std::string& lines) {
  std::vector<v1::Fault> faults;
  std::istringstream text(lines);
  for (std::string line; std::getline(text, line);) {
    const auto colon = line.find(": ");
    v1::Fault& fault = faults.emplace_back();
    if (colon != std::string::npos) fault.set_path(line.substr(0, colon));
    fault.set_text(colon == std::string::npos ? line : line.substr(colon + 2));
  }
  return faults;
}

}  // namespace

std::vector<std::string> Readers::command(const char* question, const std::filesystem::path& file) const {
  return {settings_.program,
          "--memory-mib",
          std::to_string(settings_.memory_mib),
          "--seconds",
          std::to_string(settings_.time.count()),
          question,
          file};
}

std::shared_ptr<void> Readers::take_place() {
  if (!places_.try_acquire_for(std::chrono::seconds(5))) {
    throw Refusal(Refused::too_much, "8 checkpoints are being read for others already; try again later");
  }
  return {this, [](Readers* readers) { readers->places_.release(); }};
}

void Readers::refuse(const Answer& answer, const std::filesystem::path& file) const {
  const std::string said = without_path(first_lines(answer.error), file);
  const bool too_long = answer.timed_out || answer.exit_code == 128 + SIGALRM || answer.exit_code == 128 + SIGXCPU;
  if (too_long) {
    throw Refusal(Refused::too_much, "reading the checkpoint took more than the " + std::to_string(settings_.time.count()) +
                                         " s that one question is given; ask for a smaller region");
  }
  switch (answer.exit_code) {
    case wrong_question:
      throw Refusal(Refused::bad_request, said, "bedflow field --help");
    case v1::CHECKPOINT_CORRUPT:
      throw Refusal(Refused::checkpoint_corrupt, said);
    case v1::INVALID_CASE:
      throw Refusal(Refused::invalid_case, said);
    case v1::DISK_FULL:
      throw Refusal(Refused::disk_full, said);
    case v1::OUT_OF_MEMORY:
      throw Refusal(Refused::too_much, "reading the checkpoint: " + said);
    default:
      break;
  }
  if (answer.exit_code > 128 && answer.exit_code < 128 + 65) {
    throw Refusal(Refused::reader_failed, "the process that read the checkpoint ended by signal " +
                                              std::to_string(answer.exit_code - 128) + "; the file may be crafted or damaged");
  }
  throw Refusal(Refused::backend_error,
                "bedflow-reader gave no answer: " + (said.empty() ? "exit code " + std::to_string(answer.exit_code) : said));
}

std::string Readers::answer(const char* question, const std::filesystem::path& file, const std::string& more) {
  const auto place = take_place();
  auto words = command(question, file);
  if (!more.empty()) words.push_back(more);
  Answer answer = server::ask(words, settings_.time + std::chrono::seconds(1), longest_report);
  if (answer.exit_code != 0) refuse(answer, file);
  return std::move(answer.output);
}

v1::CheckpointReport Readers::describe(const std::filesystem::path& file) {
  v1::CheckpointReport report;
  if (!report.ParseFromString(answer("describe", file)))
    throw Refusal(Refused::backend_error, "bedflow-reader's report cannot be read");
  return report;
}

std::vector<v1::Fault> Readers::verify(const std::filesystem::path& file) {
  return faults_of(answer("verify", file));
}

v1::CheckpointReport Readers::import(const std::filesystem::path& file, const std::filesystem::path& folder) {
  v1::CheckpointReport report;
  if (!report.ParseFromString(answer("import", file, folder)))
    throw Refusal(Refused::backend_error, "bedflow-reader's report cannot be read");
  return report;
}

// ---------------------------------------------------------------------------------------------------------- fields

Readers::Answering::Answering(Readers& all, const std::filesystem::path& file, const std::vector<std::string>& command)
    : all_(all),
      file_(file),
      place_(all.take_place()),
      child_(command),
      deadline_(std::chrono::steady_clock::now() + all.settings_.time) {}

std::optional<v1::FieldAnswer> Readers::Answering::next() {
  const std::string head = child_.read(4, deadline_);
  if (head.size() < 4) {
    const Answer answer = child_.end(deadline_);
    place_.reset();
    if (answer.exit_code != 0 || !head.empty()) all_.refuse(answer, file_);
    return std::nullopt;
  }
  std::uint32_t length = 0;
  std::memcpy(&length, head.data(), 4);
  bytes_ += length;
  if (length > longest_part || bytes_ > longest_answer)
    throw Refusal(Refused::too_much, "the answer is longer than 1 GiB; ask for a smaller region or fewer quantities");
  const std::string bytes = child_.read(length, deadline_);
  v1::FieldAnswer part;
  if (bytes.size() < length) all_.refuse(child_.end(deadline_), file_);
  if (!part.ParseFromString(bytes)) throw Refusal(Refused::reader_failed, "the reader's answer cannot be understood");
  return part;
}

std::unique_ptr<Readers::Answering> Readers::ask(const std::filesystem::path& file, const v1::FieldQuery& query) {
  auto words = command("field", file);
  words.push_back(query.ShortDebugString());
  return std::unique_ptr<Answering>(new Answering(*this, file, words));
}

// ----------------------------------------------------------------------------------------------------- which file

void with_checkpoint(const JobFolder& folder, const v1::CheckpointName& name,
                     const std::function<void(std::uint64_t, const std::filesystem::path&)>& works) {
  const std::string list = "bedflow checkpoint list " + name.job();
  constexpr int looks = 3;  // the engine takes the oldest away while it writes
  std::string faults;
  for (int look = 0; look < looks; ++look) {
    auto steps = folder.checkpoint_steps();
    if (name.has_step()) std::erase_if(steps, [&](std::uint64_t step) { return step != name.step(); });
    if (steps.empty()) {
      throw Refusal(
          Refused::checkpoint_not_found,
          "job " + name.job() + " has no checkpoint" + (name.has_step() ? " of step " + std::to_string(name.step()) : ""), list);
    }
    bool vanished = false;
    faults.clear();
    for (const auto step : steps) {
      const auto file = folder.checkpoint(step);
      try {
        return works(step, file);
      } catch (const Refusal& refusal) {
        const bool gone = !std::filesystem::exists(file);
        if (refusal.why != Refused::checkpoint_corrupt && !gone) throw;
        vanished = vanished || gone;
        faults += (faults.empty() ? "" : "; ") + JobFolder::checkpoint_name(step) + ": " + refusal.what();
      }
    }
    if (!vanished) break;
  }
  throw Refusal(Refused::checkpoint_corrupt, "no good checkpoint: " + faults, list);
}

}  // namespace bedflow::server
