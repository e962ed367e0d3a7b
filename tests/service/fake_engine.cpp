// An engine by contract, without physics: for tests of the server that take milliseconds. What goes wrong, and when, is said in
// the case's description, e.g. "step_ms=2 die_at=40 epoch=1":
//   step_ms=N     wall time of a step            die_at=S      kill -9 itself at step S
//   die_after=N   kill -9 itself after N steps
//   diverge_at=S  stop with DIVERGED             freeze_at=S   live on without heartbeat or steps
//   epoch=N       the mishap happens in attempt N only        refuse=PATH   the plan finds a fault there
//   plan=dies     kill -9 itself over the plan     memory_mib=N   the plan says that it needs so much
//   slow_at=S     live on at step S for slow_ms, with signs of life and nothing else
// It tells by itself when another one runs in the same folder: "doubled" is there then.
// A checkpoint's content is "good <step>"; anything else is corrupt.
#include <fcntl.h>
#include <google/protobuf/text_format.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "bedflow/v1/case.pb.h"
#include "bedflow/v1/job.pb.h"
#include "bedflow/v1/results.pb.h"
#include "record_log.h"

namespace fs = std::filesystem;
namespace v1 = bedflow::v1;

namespace {

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <class Message>
Message read(const fs::path& path) {
  Message message;
  google::protobuf::TextFormat::ParseFromString(text_of(path), &message);
  return message;
}

std::string option(const v1::Case& scene, const std::string& name, const std::string& otherwise) {
  std::istringstream words(scene.description());
  for (std::string word; words >> word;) {
    if (word.starts_with(name + "=")) return word.substr(name.size() + 1);
  }
  return otherwise;
}

class Engine {
 public:
  Engine(fs::path folder, std::uint32_t epoch, std::optional<std::uint64_t> from)
      : folder_(std::move(folder)),
        epoch_(epoch),
        scene_(read<v1::Case>(folder_ / "case.txtpb")),
        spec_(read<v1::JobSpec>(folder_ / "job.txtpb")),
        events_(folder_ / "events.log"),
        statistics_(folder_ / "statistics.log"),
        from_(from) {}

  int run() {
    if (!is_alone()) std::ofstream(folder_ / "doubled", std::ios::app) << "attempt " << epoch_ << "\n";
    const auto steps = static_cast<std::uint64_t>(std::lround(scene_.time().end() / dt()));
    if (!take_up()) return stop(v1::CHECKPOINT_CORRUPT, "no good checkpoint");
    started_at_ = step_;
    begin(static_cast<double>(steps) * dt());
    while (step_ < steps) {
      std::this_thread::sleep_for(std::chrono::milliseconds(std::stoi(option(scene_, "step_ms", "1"))));
      ++step_;
      if (is_replaced()) return v1::STALE_EPOCH;
      if (const auto reason = mishap()) return stop(*reason, "as the case asked");
      report();
      const auto& policy = spec_.checkpoints();
      const auto every = policy.has_every_simulated_seconds()
                             ? static_cast<std::uint64_t>(std::lround(policy.every_simulated_seconds() / dt()))
                             : policy.every_steps();
      if (every > 0 && step_ % every == 0) write_checkpoint();
      if (const auto reason = obey()) return stop(*reason, "as asked");
    }
    write_checkpoint();
    return stop(v1::FINISHED, "");
  }

 private:
  // Until this process ends.
  bool is_alone() const {
    const int lock = ::open((folder_ / "engine.lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    return ::flock(lock, LOCK_EX | LOCK_NB) == 0;
  }
  bool is_replaced() const { return fs::exists(folder_ / "attempts" / std::to_string(epoch_ + 1)); }
  void beat() { std::ofstream(folder_ / "heartbeat") << epoch_ << " " << ++beats_ << "\n"; }
  double dt() const { return scene_.time().step() > 0 ? scene_.time().step() : 0.01; }
  double time() const { return static_cast<double>(step_) * dt(); }
  fs::path checkpoint(std::uint64_t step) const {
    char name[48];
    std::snprintf(name, sizeof name, "checkpoint_%010llu.h5", static_cast<unsigned long long>(step));
    return folder_ / "checkpoints" / name;
  }

  void append(v1::Event event) {
    event.set_sequence(events_.next_sequence());
    event.set_epoch(epoch_);
    event.set_unix_nanos(std::chrono::system_clock::now().time_since_epoch().count());
    events_.append(static_cast<std::uint32_t>(event.what_case()), event.SerializeAsString());
  }

  bool is_good(std::uint64_t step) const { return text_of(checkpoint(step)) == "good " + std::to_string(step); }

  // The checkpoint named, or the newest good one, or the start. False: the one named is not good.
  bool take_up() {
    if (from_) {
      step_ = *from_;
      return is_good(step_);
    }
    for (const auto& entry : fs::directory_iterator(folder_ / "checkpoints")) {
      std::uint64_t step = 0;
      const std::string name = entry.path().filename();
      if (name.ends_with(".h5") && std::sscanf(name.c_str(), "checkpoint_%lu.h5", &step) == 1 && is_good(step))
        step_ = std::max(step_, step);
    }
    return true;
  }

  void begin(double end) {
    beat();
    v1::Event event;
    event.mutable_started()->set_ranks(spec_.ranks());
    event.mutable_started()->set_step(step_);
    event.mutable_started()->set_time(time());
    event.mutable_started()->set_end_time(end);
    if (step_ > 0) event.mutable_started()->set_from_checkpoint(checkpoint(step_).filename());
    append(event);
    v1::StatisticsRecord record;
    if (step_ == 0) {
      auto& monitor = *record.mutable_schema()->add_monitors();
      monitor.set_name("steps");
      monitor.set_unit("1");
    } else {
      record.mutable_resumed()->set_step(step_);
    }
    statistics_.append(static_cast<std::uint32_t>(record.what_case()), record.SerializeAsString());
  }

  void report() {
    beat();
    v1::Event event;
    event.mutable_progress()->set_step(step_);
    event.mutable_progress()->set_time(time());
    append(event);
    v1::StatisticsRecord record;
    record.mutable_sample()->set_monitor(0);
    record.mutable_sample()->set_step(step_);
    record.mutable_sample()->set_time(time());
    record.mutable_sample()->set_value(static_cast<double>(step_));
    statistics_.append(static_cast<std::uint32_t>(record.what_case()), record.SerializeAsString());
  }

  void write_checkpoint() {
    const auto path = checkpoint(step_);
    std::ofstream(path.string() + ".partial") << "good " << step_;
    fs::rename(path.string() + ".partial", path);
    v1::Event event;
    event.mutable_checkpoint()->set_file(path.filename());
    event.mutable_checkpoint()->set_step(step_);
    event.mutable_checkpoint()->set_time(time());
    event.mutable_checkpoint()->set_bytes(fs::file_size(path));
    append(event);
  }

  std::optional<v1::StopReason> mishap() {
    const auto in_epoch = std::stoul(option(scene_, "epoch", "0"));
    if (in_epoch != 0 && in_epoch != epoch_) return std::nullopt;
    const auto due = [&](const char* name) { return option(scene_, name, "") == std::to_string(step_); };
    if (due("die_at")) ::kill(::getpid(), SIGKILL);
    if (option(scene_, "die_after", "") == std::to_string(step_ - started_at_)) ::kill(::getpid(), SIGKILL);
    while (due("freeze_at")) std::this_thread::sleep_for(std::chrono::seconds(1));
    if (due("slow_at")) {
      const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(std::stoi(option(scene_, "slow_ms", "1000")));
      for (; std::chrono::steady_clock::now() < end; std::this_thread::sleep_for(std::chrono::milliseconds(100))) beat();
    }
    return due("diverge_at") ? std::optional(v1::DIVERGED) : std::nullopt;
  }

  std::optional<v1::StopReason> obey() {
    const auto control = read<v1::Control>(folder_ / "control.txtpb");
    if (control.sequence() <= obeyed_) return std::nullopt;
    obeyed_ = control.sequence();
    if (control.command() == v1::Control::NONE) return std::nullopt;
    if (!control.skip_checkpoint()) write_checkpoint();
    if (control.command() == v1::Control::SUSPEND) return v1::SUSPENDED;
    if (control.command() == v1::Control::CANCEL) return v1::CANCELLED;
    if (control.command() == v1::Control::LIMIT) return v1::WALL_LIMIT;
    return std::nullopt;
  }

  int stop(v1::StopReason reason, const std::string& message) {
    v1::Event event;
    event.mutable_stopped()->set_reason(reason);
    event.mutable_stopped()->set_message(message);
    event.mutable_stopped()->set_step(step_);
    append(event);
    return reason;
  }

  fs::path folder_;
  std::uint32_t epoch_;
  v1::Case scene_;
  v1::JobSpec spec_;
  bedflow::LogWriter events_;
  bedflow::LogWriter statistics_;
  std::optional<std::uint64_t> from_;
  std::uint64_t step_ = 0, started_at_ = 0;
  std::uint64_t obeyed_ = 0, beats_ = 0;
};

// As `bedflow-engine --plans` (engine/report/plan_report.h).
std::pair<int, std::string> plan(const v1::Case& scene) {
  if (const auto path = option(scene, "refuse", ""); !path.empty()) {
    return {v1::INVALID_CASE, path + ": refused as the case asked\n"};
  }
  if (option(scene, "plan", "") == "dies") ::kill(::getpid(), SIGKILL);
  v1::PlanReport report;
  report.set_steps(static_cast<std::uint64_t>(scene.time().end() / scene.time().step()));
  report.set_memory_bytes(std::stod(option(scene, "memory_mib", "0")) * (1 << 20));
  report.set_text("a plan of " + scene.name());
  std::string text;
  google::protobuf::TextFormat::PrintToString(report, &text);
  return {0, text};
}

int answer_plans() {
  int ranks = 0;
  std::size_t bytes = 0;
  while (std::cin >> ranks >> bytes && std::cin.get() == '\n') {
    std::string text(bytes, '\0');
    std::cin.read(text.data(), static_cast<std::streamsize>(bytes));
    v1::Case scene;
    google::protobuf::TextFormat::ParseFromString(text, &scene);
    const auto [code, answer] = plan(scene);
    std::cout << code << ' ' << answer.size() << '\n' << answer << std::flush;
  }
  return 0;
}

int snapshot(const fs::path& checkpoint) {
  const std::string text = text_of(checkpoint);
  if (!text.starts_with("good ")) {
    std::cerr << "content: not good\n";
    return v1::CHECKPOINT_CORRUPT;
  }
  v1::Snapshot snapshot;
  snapshot.set_step(std::stoull(text.substr(5)));
  snapshot.SerializeToOstream(&std::cout);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const auto value = [&](const std::string& name) -> std::optional<std::string> {
    const auto place = std::find(words.begin(), words.end(), name);
    return place == words.end() || place + 1 == words.end() ? std::nullopt : std::optional(place[1]);
  };
  if (words.at(0) == "--plans") return answer_plans();
  if (const auto file = value("--snapshot")) return snapshot(*file);
  // Under mpirun the other ranks only have to be there.
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "SLURM_PROCID"}) {
    if (const char* rank = std::getenv(name); rank && std::string(rank) != "0") return 0;
  }
  const auto from = value("--from");
  Engine engine(words.at(0), static_cast<std::uint32_t>(std::stoul(value("--epoch").value_or("1"))),
                from ? std::optional<std::uint64_t>(std::stoull(*from)) : std::nullopt);
  return engine.run();
}
