// Statistics, plots and pictures, from the server and from a job folder.
#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>

#include <random>

#include "case_file.h"
#include "cases/ready_cases.h"
#include "client_fixture.h"
#include "failure.h"
#include "record_log.h"
#include "statistics_table.h"

namespace bedflow::client {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* job_id = "j-000000000001";

v1::Estimate estimate_of(double mean, double half_width, std::uint32_t bins = 6) {
  v1::Estimate estimate;
  estimate.set_mean(mean);
  estimate.set_half_width(half_width);
  estimate.set_bins(bins);
  return estimate;
}

v1::Statistics bed_statistics() {
  v1::Statistics statistics;
  auto& series = *statistics.add_series();
  series.set_name("bed_height");
  series.set_unit("m");
  for (int i = 0; i < 2000; ++i) {
    series.add_step(static_cast<std::uint64_t>(10 * i));
    series.add_time(1e-3 * i);
    series.add_value(0.02 + 0.003 * std::sin(0.02 * i));
  }
  *series.mutable_average() = estimate_of(0.0203, 0.0004);
  *series.mutable_deviation() = estimate_of(0.002, 0.0002);
  auto& profile = *statistics.add_profiles();
  profile.set_name("void_fraction");
  profile.set_unit("1");
  for (int i = 0; i < 18; ++i) {
    profile.add_place(0.044 * (i + 0.5) / 18);
    *profile.add_average() = estimate_of(0.6 + 0.1 * std::sin(0.35 * (i + 0.5)), 0.02);
    *profile.add_deviation() = estimate_of(0.1, 0.01);
  }
  statistics.set_step(20000);
  statistics.set_time(2);
  return statistics;
}

v1::Snapshot bed_snapshot() {
  v1::Snapshot snapshot;
  snapshot.mutable_size()->set_x(0.044);
  snapshot.mutable_size()->set_y(0.12);
  snapshot.mutable_size()->set_z(0.01);
  snapshot.mutable_cells()->set_x(18);
  snapshot.mutable_cells()->set_y(48);
  snapshot.mutable_cells()->set_z(4);
  snapshot.set_diameter(0.0012);
  snapshot.set_time(0.25);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> share(0, 1);
  for (int i = 0; i < 3000; ++i) {
    const float x = 0.0006F + 0.0428F * share(random), y = 0.0006F + 0.035F * share(random),
                z = 0.0006F + 0.0088F * share(random);
    for (const float part : {x, y, z}) snapshot.add_position(part);
    snapshot.add_speed(0.5F * share(random) * y / 0.035F);
  }
  for (int j = 0; j < 48; ++j) {
    for (int i = 0; i < 18; ++i) snapshot.add_gas_fraction(j < 14 ? 0.45F + 0.01F * static_cast<float>(i) : 1);
  }
  return snapshot;
}

struct PngSize {
  int width = 0, height = 0;
};
// From the header's IHDR chunk; zeros if it is no PNG.
PngSize png_size(const std::string& bytes) {
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n") || bytes.size() < 24) return {};
  const auto word = [&](std::size_t at) {
    int value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
  };
  return {word(16), word(20)};
}

class ClientResults : public Client {
 protected:
  ClientResults() {
    service_.statistics = bed_statistics();
    service_.snapshot = bed_snapshot();
    service_.jobs[job_id] = job_of(job_id, v1::SUCCEEDED);
    service_.job_case = ready_case("mueller");
  }
  // A folder as the engine leaves it, with two bins of a series.
  std::string job_folder() const {
    const auto folder = folder_ / "job";
    std::filesystem::create_directories(folder / "checkpoints");
    std::ofstream(folder / "case.txtpb") << case_text(ready_case("mueller"));
    LogWriter log(folder / "statistics.log");
    v1::StatisticsRecord record;
    auto& monitor = *record.mutable_schema()->add_monitors();
    monitor.set_name("bed_height");
    monitor.set_unit("m");
    monitor.set_averaging_bin(0.1);
    monitor.set_averaging_bins(12);
    log.append(1, record.SerializeAsString());
    for (std::uint32_t bin = 0; bin < 2; ++bin) {
      auto& sample = *record.mutable_sample();
      sample.set_monitor(0);
      sample.set_step(bin + 1);
      sample.set_time(0.1 * (bin + 1));
      sample.set_value(0.02 + 0.01 * bin);
      log.append(1, record.SerializeAsString());
      auto& closed = *record.mutable_bin();
      closed.set_monitor(0);
      closed.set_bin(bin);
      closed.set_step(bin + 1);
      closed.add_mean(0.02 + 0.01 * bin);
      closed.add_deviation(0);
      log.append(1, record.SerializeAsString());
    }
    return folder.string();
  }
};

TEST_F(ClientResults, StatsComeAsTableJsonAndCsv) {
  const auto table = bedflow({"stats", job_id});
  EXPECT_EQ(table.exit_code, 0) << table.error;
  EXPECT_THAT(table.out, HasSubstr("0.02030 ± 0.00040"));
  EXPECT_THAT(table.out, HasSubstr("void_fraction"));
  const auto csv = bedflow({"stats", job_id, "-o", "csv"}).out;
  EXPECT_THAT(
      csv, StartsWith("name,unit,place_m,samples,last,mean,half_width,bins,deviation,deviation_half_width\nbed_height,m,,2000,"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 1 + 18);  // header, series, places
  EXPECT_THAT(bedflow({"stats", job_id, "-o", "json"}).out, HasSubstr("\"name\": \"bed_height\""));
  const auto samples = bedflow({"stats", job_id, "--samples", "-o", "csv"}).out;
  EXPECT_EQ(std::count(samples.begin(), samples.end(), '\n'), 1 + 2000);
}

TEST_F(ClientResults, StatsOfAFolderNeedNoServer) {
  stop_server();
  const auto result = bedflow({"stats", job_folder(), "-o", "csv"});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_THAT(result.out, HasSubstr("bed_height,m,,2,0.03,0.025,"));
  const auto unknown = bedflow({"stats", job_folder(), "nonsense"});
  EXPECT_EQ(unknown.exit_code, static_cast<int>(Exit::not_found));
  EXPECT_THAT(unknown.error, HasSubstr("bed_height"));
  EXPECT_EQ(bedflow({"stats", folder_.string()}).exit_code, static_cast<int>(Exit::not_found));
}

TEST_F(ClientResults, PlotDrawsAPngWithThePanelsOfItsMonitors) {
  const auto file = folder_ / "plot.png";
  const auto result = bedflow({"plot", job_id, "-o", file.string()});
  ASSERT_EQ(result.exit_code, 0) << result.error;
  const auto bytes = read(file);
  EXPECT_EQ(png_size(bytes).width, 800);
  EXPECT_EQ(png_size(bytes).height, 2 * 480 + 56);  // two panels and the title
  EXPECT_GT(bytes.size(), 20'000U);                 // an empty page of this size has some 5 kB
}

TEST_F(ClientResults, RenderDrawsTheBedToOneScale) {
  const auto file = folder_ / "bed.png";
  const auto result = bedflow({"render", job_id, "-o", file.string()});
  ASSERT_EQ(result.exit_code, 0) << result.error;
  const auto bytes = read(file);
  EXPECT_GT(png_size(bytes).height, 1000);
  EXPECT_GT(bytes.size(), 50'000U);
}

TEST_F(ClientResults, PicturesWithoutGnuplotNameThePackage) {
  const std::string path = getenv("PATH");
  setenv("PATH", folder_.c_str(), 1);
  const auto result = bedflow({"render", job_id, "-o", (folder_ / "x.png").string()});
  setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(result.exit_code, static_cast<int>(Exit::other));
  EXPECT_THAT(result.error, HasSubstr("apt-get install gnuplot-nox"));
}

// A copy of the client beside an engine of our own making.
class ClientWithEngine : public ClientResults {
 protected:
  ClientWithEngine() { std::filesystem::copy_file(program(), folder_ / "bedflow"); }
  void engine(const std::string& script) const {
    const auto file = write("bedflow-engine", "#!/bin/sh\n" + script);
    std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  }
  ChildResult run(std::vector<std::string> words) const {
    words.insert(words.begin(), (folder_ / "bedflow").string());
    return run_child(words);
  }
};

TEST_F(ClientWithEngine, ExplainPrintsThePlanForItsRanks) {
  v1::PlanReport report;
  report.set_text("the plan");
  std::string text;
  google::protobuf::TextFormat::PrintToString(report, &text);
  write("plan", text);
  engine("[ \"$1\" = --plan ] && [ -s \"$2\" ] && [ \"$3 $4\" = '--ranks 4' ] && cat " + (folder_ / "plan").string());
  const auto result = run({"explain", "mueller", "--ranks", "4"});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(result.out, "the plan\n");
}

TEST_F(ClientWithEngine, ExplainTellsInWhatTwoCasesDiffer) {
  const auto result = run({"explain", "--diff", "mueller@mfix-dpvm-upwind", "mueller@mfix-dpvm-smart"});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_THAT(result.out, AllOf(HasSubstr("gas.convection"), HasSubstr("upwind {}"), HasSubstr("smart {}")));
  EXPECT_THAT(result.out, testing::Not(HasSubstr("coupling")));
  EXPECT_THAT(run({"explain", "--diff", "mueller", "mueller"}).error, HasSubstr("the same model"));
  EXPECT_EQ(run({"explain", "--diff", "mueller", "mueller@nothing"}).exit_code, static_cast<int>(Exit::usage));
}

TEST_F(ClientWithEngine, RenderOfAFolderTakesTheCheckpointBeforeACorruptOne) {
  write("snapshot", bed_snapshot().SerializeAsString());
  const auto folder = job_folder();
  for (const char* step : {"0000000100", "0000000200"}) std::ofstream(folder + "/checkpoints/checkpoint_" + step + ".h5") << "x";
  engine("case \"$2\" in *200.h5) echo 'block 3 of gas/p is damaged' >&2; exit 20;; *) cat " + (folder_ / "snapshot").string() +
         ";; esac");
  const auto result = run({"render", folder, "-o", (folder_ / "bed.png").string()});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_THAT(result.error, HasSubstr("block 3 of gas/p is damaged; taking the one before"));
  EXPECT_GT(png_size(read(folder_ / "bed.png")).width, 0);
  EXPECT_EQ(run({"render", folder, "-o", "x.png", "--step", "200"}).exit_code, static_cast<int>(Exit::corrupt));
}

TEST(Estimate, IsRoundedToTwoDigitsOfItsHalfWidth) {
  EXPECT_EQ(estimate_text(estimate_of(0.0203456, 0.00042)), "0.02035 ± 0.00042");
  EXPECT_EQ(estimate_text(estimate_of(853.27, 31.4)), "853 ± 31");
  EXPECT_EQ(estimate_text(estimate_of(1, 0, 0)), "-");
  v1::Estimate alone;
  alone.set_mean(2.5);
  alone.set_bins(1);
  EXPECT_EQ(estimate_text(alone), "2.5");
}

}  // namespace
}  // namespace bedflow::client
