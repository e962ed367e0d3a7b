// Plot files have the structure that ParaView wants, their series follows a resumed run, and a picture shows what was stored.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "checkpoint/plot_file.h"
#include "picture.h"
#include "unit/checkpoint_test_case.h"

namespace bedflow {
namespace {

using test::SharedFolder;
namespace fs = std::filesystem;

// What tests/support/check_plot_file.py says: 0 is good.
int structure_check(const fs::path& path) {
  const std::string script = std::string(BEDFLOW_SOURCE_DIR) + "/tests/support/check_plot_file.py";
  return std::system(("/usr/bin/python3 " + script + " " + path.string() + " >&2").c_str());
}

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<Vec3> velocities_of(const std::vector<double>& pressure) {
  std::vector<Vec3> velocity(pressure.size());
  std::transform(pressure.begin(), pressure.end(), velocity.begin(), [](double p) { return Vec3{p, 2 * p, 3 * p}; });
  return velocity;
}

void write_plots(const Comm& comm, const fs::path& folder, std::uint64_t step) {
  const double time = 0.1 * static_cast<double>(step);
  const GridPart part = test::part_of(comm);
  const std::vector<double> pressure = test::cells_of(part);
  const std::vector<Vec3> velocity = velocities_of(pressure);
  write_gas_plot(comm, folder, step, time, part, {0.1, 0.1, 0.1}, {{"pressure", "Pa", pressure}, {"velocity", "m/s", velocity}});
  std::vector<Vec3> position;
  std::vector<std::int64_t> id;
  for (std::int64_t row = 0; row < test::rows_on(comm.rank()); ++row) {
    position.push_back({0.01 * static_cast<double>(row), 0.1 * comm.rank(), 0.05});
    id.push_back(100 * comm.rank() + row);
  }
  write_particle_plot(comm, folder, step, time, position, {{"velocity", "m/s", position}, {"id", "1", id}});
}

TEST(PlotFile, HasTheStructureOfVtkhdf) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  const fs::path plots = folder.job() / "plots";
  for (std::uint64_t step : {0, 5, 10}) write_plots(comm, plots, step);
  comm.barrier();
  if (!comm.root()) return;
  EXPECT_EQ(structure_check(plots / "gas.hdf.series"), 0);
  EXPECT_EQ(structure_check(plots / "particles.hdf.series"), 0);
  std::ofstream(plots / "wrong.hdf") << "no plot";
  EXPECT_NE(structure_check(plots / "wrong.hdf"), 0) << "the structure check cannot fail";
}

TEST(PlotFile, IsTheSameOnAnyNumberOfRanks) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  write_plots(comm, folder.job() / "many", 3);
  if (!comm.root()) return;
  const GridPart part = test::part_of(Comm::self());
  const std::vector<double> pressure = test::cells_of(part);
  const std::vector<Vec3> velocity = velocities_of(pressure);
  write_gas_plot(Comm::self(), folder.job() / "one", 3, 0.1 * 3, part, {0.1, 0.1, 0.1},
                 {{"pressure", "Pa", pressure}, {"velocity", "m/s", velocity}});
  EXPECT_EQ(read_text(folder.job() / "many/gas_0000000003.hdf"), read_text(folder.job() / "one/gas_0000000003.hdf"));
}

TEST(PlotFile, WithoutParticlesIsStillOne) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  write_particle_plot(comm, folder.job(), 1, 0.1, {}, {{"id", "1", std::vector<std::int64_t>{}}});
  if (comm.root()) {
    EXPECT_EQ(structure_check(folder.job() / "particles_0000000001.hdf"), 0);
  }
}

TEST(PlotSeries, ReplacesWhatAResumedRunDoesAgain) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  for (std::uint64_t step : {1, 2, 3, 4}) write_plots(comm, folder.job(), step);
  write_plots(comm, folder.job(), 2);  // resumed at step 1
  comm.barrier();
  if (!comm.root()) return;
  EXPECT_EQ(read_text(folder.job() / "gas.hdf.series"),
            "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n"
            "    {\"name\": \"gas_0000000001.hdf\", \"time\": 0.1},\n"
            "    {\"name\": \"gas_0000000002.hdf\", \"time\": 0.2}\n  ]\n}\n");
  EXPECT_FALSE(fs::exists(folder.job() / "gas_0000000003.hdf")) << "a file of the run before the resume is left";
}

TEST(CheckpointStructure, IsOneThatH5pyReads) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  const fs::path path = write_checkpoint(comm, folder.checkpoints(), test::content_of(comm), 2).path;
  if (comm.root()) {
    EXPECT_EQ(structure_check(path), 0);
  }
}

// A checkpoint of n particles whose positions count them, and ε = 0.5 + 0.1 k in layer k.
CheckpointContent bed(std::size_t particles) {
  CheckpointContent content;
  content.step = 7;
  content.time = 0.7;
  content.numbers = {{"domain/size_x", 0.2}, {"domain/size_y", 0.3}, {"domain/size_z", 0.1}, {"particles/diameter", 0.001},
                     {"cells/x", 2},         {"cells/y", 3},         {"cells/z", 2}};
  std::vector<double> position, velocity;
  for (std::size_t i = 0; i < particles; ++i) {
    for (double x : {static_cast<double>(i), 1.0, 2.0}) position.push_back(x);
    for (double v : {3.0, 0.0, 4.0}) velocity.push_back(v * static_cast<double>(i));
  }
  content.arrays.push_back({"particles/position", "m", "centres", position, std::nullopt, 3});
  content.arrays.push_back({"particles/velocity", "m/s", "velocities", velocity, std::nullopt, 3});
  const std::vector<double> fraction = {0.5, 0.5, 0.5, 0.5, 0.5, 0.9, 0.6, 0.6, 0.6, 0.6, 0.6, 0.6};
  content.arrays.push_back({"gas/fraction", "1", "gas volume fraction", fraction, GridPart{{2, 3, 2}, {0, 0, 0}, {2, 3, 2}}, 1});
  return content;
}

TEST(Picture, ShowsWhatTheCheckpointHolds) {
  const SharedFolder folder(Comm::self());
  const Picture all = read_picture(write_checkpoint(Comm::self(), folder.checkpoints(), bed(10), 2).path, 100);
  EXPECT_EQ(all.step, 7U);
  EXPECT_EQ(all.time, 0.7);
  EXPECT_EQ(all.size, (Vec3{0.2, 0.3, 0.1}));
  EXPECT_EQ(all.cells, (Int3{2, 3, 2}));
  EXPECT_EQ(all.diameter, 0.001);
  ASSERT_EQ(all.positions.size(), 10U);
  EXPECT_EQ(all.positions[9], (Vec3{9, 1, 2}));
  EXPECT_DOUBLE_EQ(all.speeds[9], 45);
  ASSERT_EQ(all.gas_fraction.size(), 6U);
  EXPECT_DOUBLE_EQ(all.gas_fraction[0], 0.55);
  EXPECT_DOUBLE_EQ(all.gas_fraction[5], 0.75);
}

TEST(Picture, ThinsEvenlyAndLivesWithoutParts) {
  const SharedFolder folder(Comm::self());
  CheckpointContent content = bed(10);
  const fs::path path = write_checkpoint(Comm::self(), folder.checkpoints(), content, 2).path;
  const Picture thinned = read_picture(path, 4);
  ASSERT_EQ(thinned.positions.size(), 4U);
  EXPECT_EQ(thinned.positions[3].x, 9);  // every third: 0, 3, 6, 9
  EXPECT_TRUE(read_picture(path, 0).positions.empty());
  content.arrays.clear();
  const Picture bare = read_picture(write_checkpoint(Comm::self(), folder.checkpoints(), content, 2).path, 4);
  EXPECT_TRUE(bare.positions.empty());
  EXPECT_TRUE(bare.gas_fraction.empty());
}

}  // namespace
}  // namespace bedflow
