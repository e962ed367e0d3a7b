// A checkpoint gives back the bits it was given, on any number of ranks, and is left in the folder's order.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "unit/checkpoint_test_case.h"

namespace bedflow {
namespace {

using test::content_of;
using test::SharedFolder;
namespace fs = std::filesystem;

const std::vector<double>& reals(const CheckpointArray& array) {
  return std::get<std::vector<double>>(array.values);
}

TEST(Checkpoint, SameRanksReadTheBitsTheyWrote) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  const CheckpointContent content = content_of(comm, 42, 300000);
  const CheckpointInfo info = write_checkpoint(comm, folder.checkpoints(), content, 2);
  EXPECT_EQ(info.path.filename(), "checkpoint_0000000042.h5");
  EXPECT_EQ(info.bytes, fs::file_size(info.path));
  const CheckpointReader reader(comm, info.path);
  EXPECT_EQ(reader.step(), 42U);
  EXPECT_EQ(reader.time(), content.time);
  EXPECT_EQ(reader.ranks(), comm.size());
  EXPECT_EQ(reader.number("totals/mass"), 1.0 / 3.0);
  EXPECT_TRUE(reader.has_number("domain/size_x"));
  EXPECT_FALSE(reader.has_number("domain/size_y"));
  EXPECT_TRUE(reader.has("gas/pressure"));
  EXPECT_FALSE(reader.has("gas/density"));
  EXPECT_FALSE(reader.has("nowhere/at/all"));
  EXPECT_EQ(reader.grid("gas/pressure", *content.arrays[0].part), reals(content.arrays[0]));
  EXPECT_EQ(reader.rows("particles/position"), reals(content.arrays[1]));
  EXPECT_EQ(reader.integer_rows("particles/id"), std::get<std::vector<std::int64_t>>(content.arrays[2].values));
  EXPECT_TRUE(reader.rows("contacts/none").empty());
  EXPECT_EQ(reader.text("case"), std::get<std::string>(content.arrays[4].values));
  EXPECT_EQ(reader.rows("statistics/bins"), reals(content.arrays[5]));
}

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Arrays of several blocks, grids cut by ranks, rows across blocks, empty ones: the path of every byte to the disk is another.
TEST(Checkpoint, OneRankWritesForAllTheFileThatEachWouldWriteItsPartOf) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  CheckpointContent content = content_of(comm, 42, 300000);
  const std::int64_t wide = 40000 * (comm.rank() + 1), before = comm.sum_before(wide);
  std::vector<double> many(static_cast<std::size_t>(3 * wide));
  for (std::size_t i = 0; i < many.size(); ++i) many[i] = std::cos(static_cast<double>(3 * before) + static_cast<double>(i));
  content.arrays.push_back({"particles/velocity", "m/s", "many rows of every rank", many, std::nullopt, 3});
  const auto written = [&](bool one_writer) {
    const CheckpointInfo info = write_checkpoint(comm, folder.checkpoints(), content, 2, 0, one_writer);
    comm.barrier();
    std::string bytes = bytes_of(info.path);
    comm.barrier();
    return bytes;
  };
  const std::string by_each = written(false), by_one = written(true);
  EXPECT_GT(by_each.size(), 3U << 20);
  EXPECT_TRUE(by_each == by_one);
  EXPECT_EQ(verify_checkpoint(folder.checkpoints() / "checkpoint_0000000042.h5"), std::vector<std::string>{});
}

TEST(Checkpoint, OneRankReadsWhatManyWrote) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  const CheckpointInfo info = write_checkpoint(comm, folder.checkpoints(), content_of(comm), 2);
  const CheckpointReader reader(Comm::self(), info.path);
  const GridPart inner = {test::shape, {2, 3, 1}, {4, 5, 3}};  // cuts through every rank's block
  EXPECT_EQ(reader.grid("gas/pressure", inner), test::cells_of(inner));
  std::int64_t rows = 0;
  for (int r = 0; r < comm.size(); ++r) rows += test::rows_on(r);
  std::vector<std::int64_t> id(static_cast<std::size_t>(rows));
  for (std::int64_t row = 0; row < rows; ++row) id[row] = 1000 - row;
  EXPECT_EQ(reader.integer_rows("particles/id"), id);
}

TEST(Checkpoint, ManyRanksShareEvenlyWhatOneWrote) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  if (comm.root()) write_checkpoint(Comm::self(), folder.checkpoints(), content_of(Comm::self(), 42, 1001), 2);
  comm.barrier();
  const CheckpointReader reader(comm, folder.checkpoints() / "checkpoint_0000000042.h5");
  const std::vector<double> mine = reader.rows("statistics/bins");
  EXPECT_NEAR(static_cast<double>(mine.size()), 1001.0 / comm.size(), 1.0);  // even, as far as 1001 divides
  const std::int64_t before = comm.sum_before(static_cast<std::int64_t>(mine.size()));
  for (std::size_t i = 0; i < mine.size(); ++i) ASSERT_EQ(mine[i], std::sin(1.0 + static_cast<double>(before + i)));
  EXPECT_EQ(comm.sum(static_cast<std::int64_t>(mine.size())), 1001);
  const GridPart part = test::part_of(comm);
  EXPECT_EQ(reader.grid("gas/pressure", part), test::cells_of(part));
}

TEST(Checkpoint, WhatIsNotThereIsNamedOnEveryRank) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  const CheckpointReader reader(comm, write_checkpoint(comm, folder.checkpoints(), content_of(comm), 2).path);
  const GridPart other = {{7, 9, 6}, {0, 0, 0}, {1, 1, 1}};
  for (const auto& [name, attempt] :
       std::map<std::string, std::function<void()>>{{"gas/pressure", [&] { reader.grid("gas/pressure", other); }},
                                                    {"gas/density", [&] { reader.rows("gas/density"); }},
                                                    {"totals/energy", [&] { reader.number("totals/energy"); }}}) {
    try {
      attempt();
      ADD_FAILURE() << "nothing was refused for " << name;
    } catch (const Stop& stop) {
      EXPECT_NE(std::string(stop.what()).find(name), std::string::npos) << stop.what();
    }
  }
}

TEST(Checkpoint, TheNewestAreKeptAndAtLeastTwo) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  for (std::uint64_t step = 1; step <= 5; ++step) write_checkpoint(comm, folder.checkpoints(), content_of(comm, step), 3);
  comm.barrier();
  std::vector<std::uint64_t> steps;
  for (const CheckpointInfo& info : list_checkpoints(folder.checkpoints())) steps.push_back(info.step);
  EXPECT_EQ(steps, (std::vector<std::uint64_t>{5, 4, 3}));
  comm.barrier();
  write_checkpoint(comm, folder.checkpoints(), content_of(comm, 6), 0);
  comm.barrier();
  EXPECT_EQ(list_checkpoints(folder.checkpoints()).size(), 2U);
}

TEST(Checkpoint, AResumeFromAnEarlierOneMakesLaterOnesVoid) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  for (std::uint64_t step : {10, 20, 30}) write_checkpoint(comm, folder.checkpoints(), content_of(comm, step), 3);
  write_checkpoint(comm, folder.checkpoints(), content_of(comm, 15), 3);  // resumed at step 10
  comm.barrier();
  std::vector<std::uint64_t> steps;
  for (const CheckpointInfo& info : list_checkpoints(folder.checkpoints())) steps.push_back(info.step);
  EXPECT_EQ(steps, (std::vector<std::uint64_t>{15, 10}));
}

TEST(Checkpoint, ATornPartialIsIgnoredAndSweptAway) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  write_checkpoint(comm, folder.checkpoints(), content_of(comm, 1), 2);
  const fs::path torn = folder.checkpoints() / "checkpoint_0000000009.epoch0.partial";
  if (comm.root()) std::ofstream(torn) << "torn";
  comm.barrier();
  std::vector<std::string> faults;
  EXPECT_EQ(newest_good_checkpoint(comm, folder.checkpoints(), faults).value().step, 1U);
  EXPECT_TRUE(faults.empty());
  comm.barrier();
  write_checkpoint(comm, folder.checkpoints(), content_of(comm, 2), 2);
  comm.barrier();
  EXPECT_FALSE(fs::exists(torn));
}

TEST(Checkpoint, AStaleAttemptLeavesNothingBehind) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  if (comm.root()) {
    fs::create_directories(folder.job() / "attempts/2");
    fs::create_directories(folder.job() / "attempts/10");
    fs::create_directories(folder.job() / "attempts/no number");
  }
  comm.barrier();
  try {
    write_checkpoint(comm, folder.checkpoints(), content_of(comm), 2, 9);
    ADD_FAILURE() << "attempt 9 wrote although attempt 10 is there";
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::stale_epoch);
    EXPECT_NE(std::string(stop.what()).find("attempt 10"), std::string::npos) << stop.what();
  }
  comm.barrier();
  EXPECT_TRUE(fs::is_empty(folder.checkpoints()));
  comm.barrier();
  EXPECT_EQ(write_checkpoint(comm, folder.checkpoints(), content_of(comm), 2, 10).step, 42U);
}

TEST(Checkpoint, AWrongArrayOnOneRankStopsAllOfThem) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  CheckpointContent content = content_of(comm);
  if (comm.rank() == comm.size() - 1) std::get<std::vector<double>>(content.arrays[0].values).pop_back();
  try {
    write_checkpoint(comm, folder.checkpoints(), content, 2);
    ADD_FAILURE() << "nothing was refused";
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::internal);
    EXPECT_NE(std::string(stop.what()).find("gas/pressure"), std::string::npos) << stop.what();
  }
}

}  // namespace
}  // namespace bedflow
