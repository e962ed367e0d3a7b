// A checkpoint of a real run under attack: any damage is found and named, the one before it is used, and a write that is cut off
// or comes from an attempt that has been replaced leaves nothing behind.
#include "checkpoint/checkpoint.h"

#include <gmock/gmock.h>
#include <poll.h>
#include <signal.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <thread>

#include "checkpoint/file_names.h"
#include "checkpoint/seal.h"
#include "real_engine_fixture.h"
#include "support/trials.h"

namespace bedflow::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr std::size_t page = 4096;

v1::CreateJobRequest short_bed() {
  auto request = bed(1, 0.003);
  request.mutable_spec()->mutable_checkpoints()->clear_every_simulated_seconds();
  request.mutable_spec()->mutable_checkpoints()->set_every_steps(5);
  return request;
}

void write_file(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

class CheckpointAttack : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(job_.run(1), 0);
    steps_ = job_.folder.checkpoint_steps();
    ASSERT_GE(steps_.size(), 2u);
    newest_ = job_.folder.checkpoint(steps_[0]);
    bytes_ = server::read_text(newest_);
    copy_ = job_.folder.root() / "copy.h5";
    std::string fault;
    const PosixFile file(newest_, PosixFile::Mode::read);
    seal_ = Seal::read(file, fault).value();
    manifest_ = read_manifest(file, seal_, fault).value();
  }

  // How verification names the part of the file that a byte belongs to.
  std::string part_of(std::size_t place) const {
    if (place < seal_bytes) return "seal";
    if (place >= seal_.manifest_place && place < seal_.manifest_place + seal_.manifest_bytes) return "manifest: ";
    for (const ManifestEntry& entry : manifest_.entries) {
      if (place >= entry.place && place < entry.place + entry.bytes)
        return entry.name + " block " + std::to_string((place - entry.place) / block_bytes) + ": ";
    }
    return "metadata (names, shapes, attributes): ";
  }
  std::string faults_of(const std::string& bytes) const {
    write_file(copy_, bytes);
    std::string all;
    for (const auto& fault : verify_checkpoint(copy_)) all += fault + "\n";
    return all;
  }

  EngineJob job_{short_bed()};
  std::vector<std::uint64_t> steps_;
  fs::path newest_, copy_;
  std::string bytes_;
  Seal seal_;
  Manifest manifest_;
};

TEST_F(CheckpointAttack, EveryFlippedBitIsFoundAndItsPlaceNamed) {
  Chance chance;
  const int flips = trials(600, 20'000);
  for (int i = 0; i < flips; ++i) {
    // One in three in what is not data, which is the smaller part: seal, metadata, manifest.
    std::size_t place = chance.below(bytes_.size());
    if (i % 3 == 0) place = i % 2 == 0 ? chance.below(page) : seal_.manifest_place + chance.below(seal_.manifest_bytes);
    std::string bytes = bytes_;
    bytes[place] = static_cast<char>(bytes[place] ^ (1 << chance.below(8)));
    ASSERT_THAT(faults_of(bytes), HasSubstr(part_of(place))) << "byte " << place;
  }
  EXPECT_EQ(faults_of(bytes_), "");
}

TEST_F(CheckpointAttack, EveryCutIsFoundWithWhatIsMissing) {
  Chance chance;
  std::vector<std::size_t> lengths = {0, 1, seal_bytes - 1, seal_bytes, bytes_.size() - 1};
  while (lengths.size() < 150) lengths.push_back(chance.below(bytes_.size()));
  for (const std::size_t length : lengths) {
    const std::string said = length < seal_bytes
                                 ? "only " + std::to_string(length) + " bytes long"
                                 : "cut short: " + std::to_string(length) + " of " + std::to_string(bytes_.size());
    ASSERT_THAT(faults_of(bytes_.substr(0, length)), HasSubstr(said));
  }
}

TEST_F(CheckpointAttack, EveryZeroedPageIsFoundAndWhatWasInItNamed) {
  int zeroed = 0;
  for (std::size_t start = 0; start < bytes_.size(); start += page) {
    std::string bytes = bytes_;
    const std::size_t end = std::min(start + page, bytes.size());
    const auto used = std::find_if(bytes.begin() + static_cast<std::ptrdiff_t>(start),
                                   bytes.begin() + static_cast<std::ptrdiff_t>(end), [](char c) { return c != 0; });
    const auto first = static_cast<std::size_t>(used - bytes.begin());
    if (first == end) continue;  // nothing but zeros
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(start), bytes.begin() + static_cast<std::ptrdiff_t>(end), '\0');
    const std::string faults = faults_of(bytes);
    const bool manifest_gone = start < seal_.manifest_place + seal_.manifest_bytes && end > seal_.manifest_place;
    ASSERT_THAT(faults, HasSubstr(manifest_gone && start > 0 ? "manifest: " : part_of(first))) << "page at " << start;
    ++zeroed;
  }
  EXPECT_GT(zeroed, 10);
}

TEST_F(CheckpointAttack, TheEngineNamesTheDamageAndTakesTheCheckpointBefore) {
  std::string flipped = bytes_, zeroed = bytes_;
  const ManifestEntry& positions = *std::find_if(manifest_.entries.begin(), manifest_.entries.end(),
                                                 [](const auto& entry) { return entry.name == "particles/position"; });
  flipped[positions.place + 100] = static_cast<char>(flipped[positions.place + 100] ^ 4);
  std::fill_n(zeroed.begin() + static_cast<std::ptrdiff_t>(positions.place), 64, '\0');
  struct Damage {
    std::string bytes, named;
  };
  std::uint32_t epoch = 1;
  for (const auto& [bytes, named] :
       {Damage{flipped, "particles/position block 0: checksum"}, Damage{zeroed, "particles/position block 0: checksum"},
        Damage{bytes_.substr(0, bytes_.size() / 2), "cut short"}, Damage{"", "not a checkpoint"}}) {
    write_file(newest_, bytes);
    ASSERT_EQ(job_.run(++epoch), 0);
    std::string warnings, from;
    for (const auto& event : job_.events()) {
      if (event.epoch() != epoch) continue;
      if (event.has_started()) from = event.started().from_checkpoint();
      if (event.log().severity() == v1::LogLine::WARNING) warnings += event.log().text() + "\n";
    }
    EXPECT_EQ(from, checkpoint_name(steps_[1]));
    EXPECT_THAT(warnings, HasSubstr(checkpoint_name(steps_[0]) + ": " + named));
    std::string fault;
    const PosixFile file(newest_, PosixFile::Mode::read);
    const auto manifest = read_manifest(file, Seal::read(file, fault).value(), fault).value();
    EXPECT_EQ(manifest.text(), manifest_.text()) << "the end of the run is not the same to the bit";
  }
}

// Tells of new files in a folder.
class NewFiles {
 public:
  explicit NewFiles(const fs::path& folder) : inotify_(::inotify_init1(IN_CLOEXEC)) {
    ::inotify_add_watch(inotify_, folder.c_str(), IN_CREATE);
  }
  ~NewFiles() { ::close(inotify_); }
  NewFiles(const NewFiles&) = delete;
  NewFiles& operator=(const NewFiles&) = delete;
  // The name of the next that is being written as a checkpoint; empty when there is none in time.
  std::string next_partial(std::chrono::milliseconds limit) {
    const auto deadline = std::chrono::steady_clock::now() + limit;
    while (std::chrono::steady_clock::now() < deadline) {
      pollfd ready{inotify_, POLLIN, 0};
      if (::poll(&ready, 1, 100) <= 0) continue;
      alignas(inotify_event) std::array<char, 4096> buffer;
      const auto got = ::read(inotify_, buffer.data(), buffer.size());
      for (std::ptrdiff_t place = 0; place < got;) {
        const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + place);
        if (std::string name = event->len > 0 ? event->name : ""; attempt_of_partial(name)) return name;
        place += static_cast<std::ptrdiff_t>(sizeof(inotify_event) + event->len);
      }
    }
    return {};
  }

 private:
  int inotify_;
};

class CheckpointWrites : public testing::Test {
 protected:
  static v1::CreateJobRequest endless_bed() {
    auto request = bed(1, 100);
    request.mutable_spec()->mutable_checkpoints()->clear_every_simulated_seconds();
    request.mutable_spec()->mutable_checkpoints()->set_every_steps(1);
    return request;
  }
  void expect_all_good() const {
    for (const auto step : job_.folder.checkpoint_steps()) {
      EXPECT_THAT(verify_checkpoint(job_.folder.checkpoint(step)), testing::IsEmpty()) << step;
    }
  }
  EngineJob job_{endless_bed()};
};

TEST_F(CheckpointWrites, KilledAtAnyMomentTheyLoseNoCheckpointThatWasThere) {
  Chance chance;
  const int kills = trials(12, 100);
  std::uint64_t newest = 0;
  int cut_off = 0;
  fs::create_directories(job_.folder.checkpoints());
  for (int i = 0; i < kills; ++i) {
    NewFiles files(job_.folder.checkpoints());
    const pid_t engine = job_.start(static_cast<std::uint32_t>(i + 1));
    std::string partial;
    for (auto writes = 1 + chance.below(3); writes > 0; --writes) partial = files.next_partial(30s);
    std::this_thread::sleep_for(
        std::chrono::microseconds(chance.below(chance.below(2) ? 2'000 : 15'000)));  // as long as writes take
    ::kill(engine, SIGKILL);
    server::wait_for_exit(engine);
    ASSERT_NE(partial, "");
    cut_off += fs::exists(job_.folder.checkpoints() / partial);
    const auto steps = job_.folder.checkpoint_steps();
    EXPECT_GE(steps.empty() ? 0 : steps[0], newest);
    if (!steps.empty()) newest = steps[0];
    expect_all_good();
  }
  if (kills >= 100) {  // a dozen may all miss
    EXPECT_GT(cut_off, kills / 10) << "too few kills fell into a write";
  }
  EXPECT_GT(newest, 0u);
  std::cout << kills << " kills, " << cut_off << " of them in a write, newest checkpoint of step " << newest << "\n";
}

TEST_F(CheckpointWrites, AnAttemptThatHasBeenReplacedCommitsNothing) {
  fs::create_directories(job_.folder.checkpoints());
  for (std::uint32_t epoch = 1; epoch < 20; epoch += 2) {
    NewFiles files(job_.folder.checkpoints());
    const pid_t engine = job_.start(epoch);
    ASSERT_NE(files.next_partial(30s), "");
    const std::string partial = files.next_partial(30s);  // the second: the first is where it took up
    const std::string name = partial.substr(0, partial.find('.')) + ".h5";
    fs::create_directories(job_.folder.attempt(epoch + 1));  // another attempt begins, while this one writes
    EXPECT_EQ(server::wait_for_exit(engine), v1::STALE_EPOCH);
    EXPECT_FALSE(fs::exists(job_.folder.checkpoints() / name)) << name;
    EXPECT_FALSE(fs::exists(job_.folder.checkpoints() / partial)) << partial;
    const auto events = job_.events();  // checks that the log is sound
    EXPECT_FALSE(events.back().has_stopped()) << "it wrote into the other attempt's log";
    expect_all_good();
  }
}

}  // namespace
}  // namespace bedflow::test
