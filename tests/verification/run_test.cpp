// A job folder from beginning to end: stopped, resumed, damaged, refused.
#include "run.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bedflow/v1/job.pb.h"
#include "record_log.h"
#include "statistics_file.h"
#include "support/scene.h"

namespace bedflow {
namespace {

const std::string monitors = R"(
  monitors { name: "energy" kinetic_energy {} interval: 0 averaging { start: 0.0005 bin: 0.0007 bins: 4 } }
  monitors { name: "fraction" void_fraction { height: 0.006 } averaging { bin: 0.0009 bins: 4 } }
  monitors { name: "overlap" max_overlap {} interval: 0.0004 }
  monitors { name: "momentum" momentum_balance {} interval: 0 })";

std::string short_bed() {
  return with(small_bed("spring { friction: 0.3 }", monitors), "time { end: 1 }", "time { end: 0.004 }");
}

void put(const Comm& comm, const std::filesystem::path& path, const std::string& text) {
  if (comm.root()) {
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
  }
  comm.barrier();
}

std::vector<v1::Event> events(const std::filesystem::path& folder) {
  std::vector<v1::Event> result;
  LogReader reader(folder / "events.log");
  EXPECT_TRUE(reader.read([&](const LogRecord& record) { EXPECT_TRUE(result.emplace_back().ParseFromString(record.payload)); }));
  return result;
}

// The arrays of the newest checkpoint, as bytes, but for the text of the case.
std::string final_state(const Comm& comm, const std::filesystem::path& folder) {
  std::vector<std::string> faults;
  const auto info = newest_good_checkpoint(comm, folder / "checkpoints", faults);
  EXPECT_TRUE(info.has_value());
  const CheckpointReader reader(comm, info->path);
  std::ostringstream text;
  text.precision(17);
  text << reader.step() << " " << reader.time() << " ";
  for (const char* name : {"particles/position", "particles/velocity", "particles/spin", "contacts/pair_displacement"})
    for (const double value : reader.rows(name)) text << value << " ";
  return text.str() + reader.text("statistics/state");
}

class JobRun : public testing::Test {
 protected:
  Comm comm = Comm::world();
  TestFolder folder{comm};
  std::filesystem::path fresh(const std::string& name, const std::string& case_text, const std::string& job = "") {
    put(comm, folder.path() / name / "case.txtpb", case_text);
    if (!job.empty()) put(comm, folder.path() / name / "job.txtpb", job);
    return folder.path() / name;
  }
  // The reason that the run gives, and that its last event repeats.
  Reason run_in(const std::filesystem::path& path) {
    const Reason reason = run(comm, {path, 0, std::nullopt});
    const auto all = events(path);
    EXPECT_TRUE(!all.empty() && all.back().has_stopped() && all.back().stopped().reason() == static_cast<int>(reason));
    return reason;
  }
};

TEST_F(JobRun, SuspendedAndResumedGivesTheSameStateAndTheSameStatistics) {
  const auto through = fresh("through", short_bed());
  EXPECT_EQ(run_in(through), Reason::finished);

  // Suspended at the first step that polls, then asked to checkpoint every 7 steps, its newest checkpoint damaged, and resumed.
  const auto stopped = fresh("stopped", short_bed(), "checkpoints { every_steps: 7 }");
  put(comm, stopped / "control.txtpb", "sequence: 1 command: SUSPEND");
  EXPECT_EQ(run_in(stopped), Reason::suspended);
  EXPECT_FALSE(std::filesystem::exists(stopped / "control.txtpb"));  // obeyed once
  EXPECT_EQ(run_in(stopped), Reason::finished);

  EXPECT_EQ(final_state(comm, stopped), final_state(comm, through));
  if (!comm.root()) return;
  const auto statistics = [](const std::filesystem::path& path) {
    v1::Statistics all = read_statistics(path / "statistics.log", {});
    return all.DebugString();
  };
  EXPECT_EQ(statistics(stopped), statistics(through));
  const v1::Statistics all = read_statistics(through / "statistics.log", {});
  EXPECT_EQ(all.series(0).average().bins(), 4u);
  EXPECT_GT(all.series(0).average().mean(), 0);
  EXPECT_EQ(all.profiles(0).average_size(), 6);
  for (const double residual : all.series(2).value()) EXPECT_LT(residual, 1e-13);  // the exchange closes to round-off
}

TEST_F(JobRun, ADamagedNewestCheckpointIsToldAndTheOneBeforeIsUsed) {
  const auto through = fresh("through", short_bed());
  EXPECT_EQ(run_in(through), Reason::finished);
  const auto hurt = fresh("hurt", short_bed(), "checkpoints { every_steps: 10 }");
  EXPECT_EQ(run_in(hurt), Reason::finished);
  const auto all = list_checkpoints(hurt / "checkpoints");
  ASSERT_GE(all.size(), 2u);
  if (comm.root()) {
    std::fstream file(all.front().path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(static_cast<std::streamoff>(std::filesystem::file_size(all.front().path) / 2));
    const char byte = static_cast<char>(file.get() ^ 0x10);
    file.seekp(-1, std::ios::cur);
    file.put(byte);
  }
  comm.barrier();
  EXPECT_EQ(run_in(hurt), Reason::finished);
  EXPECT_EQ(final_state(comm, hurt), final_state(comm, through));
  bool told = false;
  for (const v1::Event& event : events(hurt)) {
    told = told || (event.has_log() && event.log().severity() == v1::LogLine::WARNING &&
                    event.log().text().find(all.front().path.filename().string()) != std::string::npos);
  }
  EXPECT_TRUE(told);
}

// Particles that fall to one side take the cuts between the blocks with them.
TEST_F(JobRun, BlocksFollowTheParticlesAlsoOverAResume) {
  const std::string falling = R"(name: "falling" domain { size { x: 0.06 y: 0.012 z: 0.012 } } gravity { x: 4 y: -5 z: -5 }
    particles { diameter: 0.002 density: 1000 linear_spring_dashpot { stiffness: 1000 restitution: 0.5 } spring { friction: 0.3 }
      symplectic_euler {} random { count: 250 seed: 1 region { low {} high { x: 0.03 y: 0.012 z: 0.012 } } } }
    monitors { name: "energy" kinetic_energy {} interval: 0.001 } time { end: 0.1 })";
  const auto through = fresh("through", falling);
  EXPECT_EQ(run_in(through), Reason::finished);
  const auto stopped = fresh("stopped", falling, "checkpoints { every_steps: 130 }");
  put(comm, stopped / "control.txtpb", "sequence: 1 command: SUSPEND");
  EXPECT_EQ(run_in(stopped), Reason::suspended);
  EXPECT_EQ(run_in(stopped), Reason::finished);
  EXPECT_EQ(final_state(comm, stopped), final_state(comm, through));
  const auto moves = [](const std::filesystem::path& job) {
    return nlohmann::json::parse(std::ifstream(job / "summary.json"))["block_moves"].get<int>();
  };
  if (comm.size() > 1) {
    EXPECT_GT(moves(through), 1);                   // at the start, and on the way
    EXPECT_EQ(moves(stopped), moves(through) - 1);  // the start's was in its first attempt
  } else {
    EXPECT_EQ(moves(through), 0);
  }
}

// The particles of a settled bed begin another case, on another grid and by another law: at their places, at time 0, with the gas
// as that case has it.
TEST_F(JobRun, APackingIsTakenAsItLies) {
  const auto settled = fresh("settled", with(short_bed(), "time { end: 0.004 }", "time { end: 0.0005 }"));
  ASSERT_EQ(run_in(settled), Reason::finished);
  const auto source = list_checkpoints(settled / "checkpoints").front().path;
  std::string other = with(with(short_bed(), "cells { x: 6 y: 14 z: 4 }", "cells { x: 5 y: 12 z: 3 }"), "spring {", "coulomb {");
  other = with(other, "time { end: 0.004 }", "time { end: 0.0005 }");
  const auto packed = [&](const std::string& name, const std::string& text) {
    auto path = fresh(name, text, "checkpoints { keep: 9 }");
    if (comm.root()) std::filesystem::copy_file(source, path / "packing.h5");
    comm.barrier();
    return path;
  };
  const auto path = packed("packed", other);
  EXPECT_EQ(run_in(path), Reason::finished);
  const auto checkpoints = list_checkpoints(path / "checkpoints");
  const CheckpointReader before(comm, source), after(comm, checkpoints.back().path);
  EXPECT_EQ(after.time(), 0);
  EXPECT_EQ(after.step(), 0u);
  const auto by_id = [&](const CheckpointReader& reader) {  // all ranks' particles
    std::map<double, std::vector<double>> particles;
    const auto ids = reader.integer_rows("particles/id");
    const auto places = reader.rows("particles/position"), velocities = reader.rows("particles/velocity");
    std::vector<double> mine;
    for (std::size_t i = 0; i < ids.size(); ++i)
      mine.insert(mine.end(), {static_cast<double>(ids[i]), places[3 * i], places[3 * i + 1], places[3 * i + 2],
                               velocities[3 * i], velocities[3 * i + 1], velocities[3 * i + 2]});
    const auto all = comm.gather_all(mine);
    for (std::size_t i = 0; i < all.size(); i += 7)
      particles[all[i]] = {all.begin() + static_cast<std::ptrdiff_t>(i) + 1, all.begin() + static_cast<std::ptrdiff_t>(i) + 7};
    return particles;
  };
  EXPECT_EQ(by_id(after).size(), 600u);
  EXPECT_EQ(by_id(after), by_id(before));

  // Others than its own particles cannot be there.
  EXPECT_EQ(run_in(packed("larger", with(other, "diameter: 0.0012", "diameter: 0.0011"))), Reason::invalid_case);
  EXPECT_NE(events(folder.path() / "larger").back().stopped().message().find("the largest diameter is 0.0012 there"),
            std::string::npos);
}

TEST_F(JobRun, EveryReasonToStopHasItsName) {
  std::string bed = short_bed();
  const auto cancelled = fresh("cancelled", bed);
  put(comm, cancelled / "control.txtpb", "sequence: 1 command: CANCEL skip_checkpoint: true");
  EXPECT_EQ(run_in(cancelled), Reason::cancelled);
  EXPECT_EQ(run_in(fresh("limit", bed, "wall_limit_seconds: 1e-6")), Reason::wall_limit);
  EXPECT_EQ(run_in(fresh("nonsense", "name: 3")), Reason::invalid_case);
  EXPECT_EQ(run_in(fresh("stubborn", with(bed, "simple {}", "simple { tolerance: 1e-14 max_iterations: 2 }"))),
            Reason::not_converged);
  // Without gravity and with a speed of its own, the one particle leaves through the open top.
  EXPECT_EQ(
      run_in(fresh("lost", R"(name: "lost" domain { size { x: 0.01 y: 0.01 z: 0.01 } faces { y_high { outflow {} } } } gravity {}
      particles { diameter: 0.001 density: 1000 linear_spring_dashpot { stiffness: 100 restitution: 0.9 } frictionless {} symplectic_euler {}
        placed { spheres { position { x: 0.005 y: 0.009 z: 0.005 } velocity { y: 1 } } } } time { end: 0.1 })")),
      Reason::particle_lost);
}

TEST_F(JobRun, ASceneThatDoesNotFitIntoMemoryIsToldAsSuch) {
  if (comm.size() > 1) GTEST_SKIP() << "the ranks would be ended by MPI";
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer ends a program that asks for too much memory before it can say so";
#endif
  const std::string wide = with(short_bed(), "size { x: 0.015 y: 0.036 z: 0.01 }", "size { x: 100 y: 100 z: 100 }");
  const auto path = fresh("huge", with(wide, "cells { x: 6 y: 14 z: 4 }", "cells { x: 4096 y: 4096 z: 4096 }"));
  EXPECT_EXIT(run(comm, {path, 0, std::nullopt}), testing::ExitedWithCode(static_cast<int>(Reason::out_of_memory)),
              "out of memory");
  const auto all = events(path);
  ASSERT_TRUE(!all.empty() && all.back().has_stopped());
  EXPECT_EQ(all.back().stopped().reason(), v1::OUT_OF_MEMORY);
}

TEST_F(JobRun, TheSummaryTellsBalanceAndCommunication) {
  const auto path = fresh("told", short_bed());
  ASSERT_EQ(run_in(path), Reason::finished);
  std::ifstream file(path / "summary.json");
  const auto summary = nlohmann::json::parse(file);
  const double balance = summary.at("balance"), share = summary.at("communication_share");
  double seconds = 0, messages = 0;
  for (const auto& rank : summary.at("per_rank")) {
    seconds += rank.at("communication_seconds").get<double>();
    messages += rank.at("messages").get<double>();
  }
  if (comm.size() == 1) {
    EXPECT_EQ(balance, 1);
    EXPECT_EQ(share, 0);
    EXPECT_EQ(messages, 0);
  } else {
    EXPECT_GT(balance, 1);
    EXPECT_LE(balance, comm.size());
    EXPECT_GT(share, 0);
    EXPECT_LT(share, 1);
    EXPECT_GE(messages, summary.at("substeps").get<double>());  // ghosts follow in every sub-step
    EXPECT_LE(seconds, summary.at("wall_seconds").get<double>() * comm.size());
  }
}

TEST_F(JobRun, EventsAreNumberedWithoutAGapOverAllAttempts) {
  const auto path = fresh("twice", short_bed());
  put(comm, path / "control.txtpb", "sequence: 1 command: SUSPEND");
  EXPECT_EQ(run_in(path), Reason::suspended);
  EXPECT_EQ(run_in(path), Reason::finished);
  std::uint64_t expected = 0;
  for (const v1::Event& event : events(path)) EXPECT_EQ(event.sequence(), ++expected);
  EXPECT_GT(expected, 6u);
}

}  // namespace
}  // namespace bedflow
