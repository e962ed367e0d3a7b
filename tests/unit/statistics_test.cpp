// The monitors against closed forms, at any number of ranks: particles and cells are dealt to the ranks that own them.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "base/stop.h"
#include "statistics/monitors.h"

namespace bedflow {
namespace {

std::vector<ParticleType> spheres_of_two_kilograms() {
  return {{.radius = 0.01, .density = 2 / (4e-6 / 3 * std::numbers::pi), .distributed = false}};
}

constexpr double round_off = 1e-13;  // relative, of sums of tens of terms in any order

StatisticScene scene_of(const Decomposition& decomposition) {
  return {decomposition.size(), decomposition.global_cells()};
}

// A box 0.4 × 0.8 × 0.2 m of 4 × 8 × 2 cells with room for fields and particles.
struct Box {
  Decomposition decomposition{Comm::world(), {4, 8, 2}, {0.4, 0.8, 0.2}, {false, false, false}};
  Grid grid{decomposition};
  Field pressure{grid}, fraction{grid};
  ParticleStore particles;

  template <class Function>
  void set(Field& field, Function value) const {  // value(x, y, z) at the cells' centres
    for (int k = 0; k < grid.cells[2]; ++k)
      for (int j = 0; j < grid.cells[1]; ++j)
        for (int i = 0; i < grid.cells[0]; ++i) {
          field(i, j, k) = value(grid.low.x + (i + 0.5) * grid.spacing.x, grid.low.y + (j + 0.5) * grid.spacing.y,
                                 grid.low.z + (k + 0.5) * grid.spacing.z);
        }
  }
  void add(Vec3 position, Vec3 velocity, Vec3 spin = {}) {
    if (decomposition.owner(position) != decomposition.comm().rank()) return;
    particles.add(static_cast<std::int64_t>(particles.owned), position, velocity, spin);
  }
  void add_ghost() {  // of no account to any statistic
    particles.add(99, {0.2, 0.4, 0.1}, {1e6, 1e6, 1e6}, {1e6, 1e6, 1e6});
    --particles.owned;
  }
  void clear() { particles = {}; }
  std::vector<ParticleType> types = spheres_of_two_kilograms();
  Observation observation() const {
    return {
        .decomposition = decomposition,
        .grid = &grid,
        .pressure = &pressure,
        .fraction = &fraction,
        .particles = &particles,
        .types = &types,
    };
  }
};

struct Bin {
  std::uint64_t step;
  std::vector<double> mean, deviation;
};
// What came out of the sink.
struct Results {
  std::map<std::size_t, std::vector<SampleOut>> samples;
  std::map<std::size_t, std::map<int, Bin>> bins;

  StatisticsSink sink() {
    return {[this](const SampleOut& s) { samples[s.monitor].push_back(s); },
            [this](const BinOut& b) {
              bins[b.monitor][b.bin] = {b.step, {b.mean.begin(), b.mean.end()}, {b.deviation.begin(), b.deviation.end()}};
            }};
  }
};

MonitorSetup every_step(Statistic statistic) {
  return {.name = "m", .statistic = statistic, .interval = 0};
}
MonitorSetup averaged(Statistic statistic, double start, double bin, int bins) {
  return {
      .name = "m", .statistic = statistic, .interval = 0, .averaging_start = start, .averaging_bin = bin, .averaging_bins = bins};
}

// The value of a series, observed once.
double value_of(const Statistic& statistic, const Observation& now) {
  Results results;
  Monitors monitors(scene_of(now.decomposition), {every_step(statistic)}, results.sink());
  monitors.observe(now, 1, 0.1, 0.1);
  return results.samples[0].empty() ? std::nan("") : results.samples[0][0].value;
}
// The values of a profile: its average over one bin of one step.
std::vector<double> profile_of(const Statistic& statistic, const Observation& now) {
  Results results;
  Monitors monitors(scene_of(now.decomposition), {averaged(statistic, 0, 0.1, 1)}, results.sink());
  monitors.observe(now, 1, 0.1, 0.1);
  return results.bins[0].at(0).mean;
}

// Particle statistics ------------------------------------------------------------------------------------------------

TEST(KineticEnergy, IsThatOfTranslationAndRotationOfOwnedParticles) {
  Box box;
  box.add({0.1, 0.1, 0.05}, {3, 0, 4}, {0, 10, 0});
  box.add({0.3, 0.7, 0.15}, {0, 1, 0}, {0, 0, 20});
  box.add_ghost();
  const double expected = 0.5 * 2 * (25 + 1) + 0.5 * (0.4 * 2 * 0.01 * 0.01) * (100 + 400);
  EXPECT_NEAR(value_of(KineticEnergy{}, box.observation()), expected, round_off * expected);
}

TEST(BedHeight, IsTheMeanHeightOfTheParticlesInTheWindow) {
  Box box;
  box.add({0.1, 0.10, 0.05}, {});
  box.add({0.3, 0.30, 0.05}, {});
  box.add({0.3, 0.60, 0.05}, {});
  box.add({0.3, 0.70, 0.15}, {});  // too deep
  EXPECT_NEAR(value_of(BedHeight{}, box.observation()), 1.7 / 4, round_off);
  EXPECT_NEAR(value_of(BedHeight{.above = 0.2, .depth = 0.1}, box.observation()), 0.45, round_off);
  EXPECT_TRUE(std::isnan(value_of(BedHeight{.above = 0.75}, box.observation()))) << "no particle, no sample";
}

TEST(ParticleStatistics, CountAndMomentumAreSumsOverAllRanks) {
  Box box;
  for (int i = 0; i < 8; ++i) box.add({0.02 + 0.05 * i, 0.05 + 0.1 * i, 0.03 + 0.02 * i}, {1, i * 1.0, -1});
  box.add_ghost();
  EXPECT_EQ(value_of(ParticleCount{}, box.observation()), 8);
  EXPECT_EQ(value_of(ParticleMomentum{.axis = 1}, box.observation()), 2 * 28);
  EXPECT_EQ(value_of(ParticleMomentum{.axis = 2}, box.observation()), -2 * 8);
}

TEST(VelocityProfile, IsTheMeanOfTheParticlesInEachTopHatBin) {
  Box box;
  box.add({0.05, 0.40, 0.05}, {0, 1, 0});
  box.add({0.07, 0.41, 0.15}, {0, 2, 0});
  box.add({0.15, 0.40, 0.05}, {0, 5, 0});
  box.add({0.15, 0.45, 0.05}, {0, 9, 0});   // above the slab
  box.add({0.15, 0.40, 0.199}, {0, 9, 0});  // behind it
  box.add({0.4, 0.39, 0.10}, {0, -3, 0});   // on the wall: the last bin
  const VelocityProfile law{.height = 0.4, .half_height = 0.02, .bins = 4, .component = 1, .depth_low = 0, .depth_high = 0.18};
  const auto values = profile_of(law, box.observation());
  ASSERT_EQ(values.size(), 4u);
  EXPECT_NEAR(values[0], 1.5, round_off);
  EXPECT_EQ(values[1], 5);
  EXPECT_TRUE(std::isnan(values[2])) << "an empty bin has no velocity";
  EXPECT_EQ(values[3], -3);
  const Monitors monitors(scene_of(box.decomposition), {every_step(law)}, {});
  EXPECT_TRUE(monitors.is_profile(0));
  EXPECT_EQ(monitors.unit(0), "m/s");
  EXPECT_NEAR(monitors.places(0)[3], 0.35, round_off);
}

// Gas statistics -----------------------------------------------------------------------------------------------------

TEST(PressureDrop, CountsTheFallThatDrivesAPeriodicFlow) {
  Box box;
  Observation now = box.observation();
  const double without = value_of(PressureDrop{.low = 0.0831, .high = 0.6123}, now);
  now.pressure_fall = 40;
  EXPECT_NEAR(value_of(PressureDrop{.low = 0.0831, .high = 0.6123}, now), without + 40 * (0.6123 - 0.0831), 1e-11);
}

TEST(PressureDrop, OfALinearPressureIsItsSlopeTimesTheDistance) {
  Box box;
  box.set(box.pressure, [](double x, double y, double z) { return 7 - 100 * y + 3 * (x - 0.2) + 11 * (z - 0.1); });
  // Taps between cell planes; the slopes along x and z have no mean over a plane.
  EXPECT_NEAR(value_of(PressureDrop{.low = 0.0831, .high = 0.6123}, box.observation()), 100 * (0.6123 - 0.0831), 1e-11);
  // Beyond the last centre the nearest row counts.
  EXPECT_NEAR(value_of(PressureDrop{.low = 0.01, .high = 0.8}, box.observation()), 100 * 0.7, 1e-11);
}

TEST(VoidFractionProfile, IsLinearBetweenRowsAndAveragedOverTheDepth) {
  Box box;
  box.set(box.fraction, [](double x, double y, double z) { return 0.4 + 0.5 * x + 0.2 * y + 0.3 * (z - 0.1); });
  const auto values = profile_of(VoidFractionProfile{.height = 0.333}, box.observation());
  const Monitors monitors(scene_of(box.decomposition), {every_step(VoidFractionProfile{})}, {});
  const auto places = monitors.places(0);
  ASSERT_EQ(values.size(), 4u);
  ASSERT_EQ(places.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(places[i], 0.05 + 0.1 * i, round_off);
    EXPECT_NEAR(values[i], 0.4 + 0.5 * places[i] + 0.2 * 0.333, round_off);
  }
}

TEST(Monitors, AStatisticOfAnAbsentPartHasNoValues) {
  const Box box;
  const Observation nothing{.decomposition = box.decomposition};
  EXPECT_TRUE(std::isnan(value_of(PressureDrop{.low = 0, .high = 0.5}, nothing)));
  EXPECT_TRUE(std::isnan(value_of(KineticEnergy{}, nothing)));
}

// When ---------------------------------------------------------------------------------------------------------------

// Steps of 0.1 s whose time is summed, so that it carries round-off.
template <class Each>
void walk(Monitors& monitors, Observation now, int from, int to, Each each, int last = 0) {
  double time = 0;
  for (int step = 1; step <= to; ++step) {
    time += 0.1;
    if (step <= from) continue;
    now.mass_residual = each(time);
    now.max_overlap = step % 4 == 1 ? 0.5 : 0.01;  // its peaks fall between samples
    monitors.observe(now, static_cast<std::uint64_t>(step), time, 0.1, step == last);
  }
}
double same(double time) {
  return time;
}

TEST(Monitors, SamplesAreTakenAtMultiplesOfTheIntervalInSpiteOfRoundOff) {
  const Box box;
  Results results;
  Monitors monitors(scene_of(box.decomposition), {{.name = "m", .statistic = MassBalance{}, .interval = 0.3}}, results.sink());
  monitors.observe(box.observation(), 0, 0, 0);
  walk(monitors, box.observation(), 0, 100, same, 100);
  std::vector<std::uint64_t> steps, expected;
  for (const auto& sample : results.samples[0]) steps.push_back(sample.step);
  for (std::uint64_t k = 0; k <= 99; k += 3) expected.push_back(k);
  expected.push_back(100);  // the last step, due or not
  EXPECT_EQ(steps, expected);
}

TEST(Monitors, BinsOfARampHoldExactlyTheirStepsInSpiteOfRoundOff) {
  const Box box;
  Results results;
  Monitors monitors(scene_of(box.decomposition), {averaged(MassBalance{}, 1, 0.7, 5)}, results.sink());
  walk(monitors, box.observation(), 0, 60, same);
  ASSERT_EQ(results.bins[0].size(), 5u);
  for (int i = 0; i < 5; ++i) {
    // Steps 11+7i … 17+7i: the mean of their end times, and the deviation of seven equidistant values, 0.1·√((49−1)/12) = 0.2.
    EXPECT_NEAR(results.bins[0].at(i).mean[0], 1.4 + 0.7 * i, 1e-12);
    EXPECT_NEAR(results.bins[0].at(i).deviation[0], 0.2, 1e-12);
    EXPECT_EQ(results.bins[0].at(i).step, 17u + 7 * i);
  }
}

TEST(Monitors, AStepThatStraddlesAnEdgeCountsToTheBinThatHoldsItsEnd) {
  const Box box;
  Results results;
  Monitors monitors(scene_of(box.decomposition), {averaged(MassBalance{}, 0.5, 1, 2)}, results.sink());
  Observation now = box.observation();
  auto step = [&, n = 0](double time, double dt, double value) mutable {
    now.mass_residual = value;
    monitors.observe(now, static_cast<std::uint64_t>(++n), time, dt);
  };
  step(0.4, 0.4, 100);  // before the first bin
  step(0.8, 0.4, 1);    // straddles T0: bin 0, with its whole length
  step(1.4, 0.6, 3);    // bin 0
  step(1.6, 0.2, 7);    // straddles into bin 1, and closes bin 0
  EXPECT_EQ(results.bins[0].at(0).step, 4u);
  EXPECT_NEAR(results.bins[0].at(0).mean[0], (0.4 * 1 + 0.6 * 3) / 1.0, round_off);
  EXPECT_NEAR(results.bins[0].at(0).deviation[0], std::sqrt(0.4 * 1 + 0.6 * 9 - 2.2 * 2.2), round_off);
  EXPECT_EQ(results.bins[0].count(1), 0u);
  step(2.6, 1.0, 9);  // passes the last edge: it counts to no bin, and closes bin 1
  EXPECT_EQ(results.bins[0].at(1).mean[0], 7);
  EXPECT_EQ(results.bins[0].size(), 2u);
}

TEST(Monitors, AConstantSignalHasItsValueAndNoDeviation) {
  const Box box;
  Results results;
  Monitors monitors(scene_of(box.decomposition), {averaged(MassBalance{}, 0, 1, 5)}, results.sink());
  walk(monitors, box.observation(), 0, 50, [](double) { return 0.1 + 1e9; });  // large beside its deviation: no cancellation
  ASSERT_EQ(results.bins[0].size(), 5u);
  for (const auto& [number, bin] : results.bins[0]) {
    EXPECT_EQ(bin.mean[0], 0.1 + 1e9);
    EXPECT_EQ(bin.deviation[0], 0);
  }
}

TEST(Monitors, InstantsWithAnEmptyBinAreLeftOutOfThatBin) {
  Box box;
  Results results;
  const VelocityProfile law{.height = 0.4, .half_height = 0.1, .bins = 2};
  Monitors monitors(scene_of(box.decomposition), {averaged(law, 0, 0.4, 1)}, results.sink());
  for (int step = 1; step <= 4; ++step) {
    box.clear();
    box.add({0.1, 0.4, 0.1}, {0, 1.0 * step, 0});
    if (step == 3) box.add({0.3, 0.4, 0.1}, {0, 8, 0});
    monitors.observe(box.observation(), static_cast<std::uint64_t>(step), 0.1 * step, 0.1);
  }
  const Bin& bin = results.bins[0].at(0);
  EXPECT_NEAR(bin.mean[0], 2.5, round_off);
  EXPECT_EQ(bin.mean[1], 8) << "the three empty instants count as nothing, not as 0";
  EXPECT_EQ(bin.deviation[1], 0);
}

TEST(MaxOverlap, ASampleHoldsThePeakSinceTheSampleBefore) {
  const Box box;
  Results results;
  Monitors monitors(scene_of(box.decomposition), {{.name = "m", .statistic = MaxOverlap{}, .interval = 0.3}}, results.sink());
  Observation now = box.observation();
  const bool last_rank = now.decomposition.comm().rank() == now.decomposition.comm().size() - 1;
  for (int step = 1; step <= 7; ++step) {
    now.max_overlap = last_rank ? (step == 2 ? 0.5 : 0.01 * step) : 0;
    monitors.observe(now, static_cast<std::uint64_t>(step), 0.1 * step, 0.1);
  }
  std::vector<double> values;
  for (const auto& sample : results.samples[0]) values.push_back(sample.value);
  EXPECT_EQ(values, (std::vector<double>{0.01, 0.5, 0.06}));  // steps 1 (the first), 3, 6
}

// Checkpoints --------------------------------------------------------------------------------------------------------

TEST(Monitors, ResumedInTheMiddleOfABinTheyGoOnWithTheSameBits) {
  Box box;
  for (int i = 0; i < 8; ++i) box.add({0.02 + 0.05 * i, 0.35 + 0.01 * i, 0.03 + 0.02 * i}, {0.1, i * 0.3, -1});
  const std::vector<MonitorSetup> setups{{.name = "a",
                                          .statistic = MassBalance{},
                                          .interval = 0.3,
                                          .averaging_start = 0.25,
                                          .averaging_bin = 0.77,
                                          .averaging_bins = 9},
                                         averaged(VelocityProfile{.height = 0.4, .half_height = 0.1, .bins = 3}, 0, 1.3, 4),
                                         {.name = "c", .statistic = MaxOverlap{}, .interval = 0.4}};
  const auto signal = [](double time) { return std::sin(7 * time) / 3; };
  const Observation now = box.observation();
  Results through;
  Monitors whole(scene_of(box.decomposition), setups, through.sink());
  walk(whole, now, 0, 60, signal, 60);
  for (const int cut : {1, 7, 31, 52}) {
    Results a, b;
    Monitors until(scene_of(box.decomposition), setups, a.sink());
    walk(until, now, 0, cut, signal);
    Monitors after(scene_of(box.decomposition), setups, b.sink());
    after.restore(until.state());
    EXPECT_EQ(after.state(), until.state());
    walk(after, now, cut, 60, signal, 60);
    EXPECT_EQ(after.state(), whole.state());
    for (std::size_t m = 0; m < setups.size(); ++m) {
      std::vector<double> joined, expected;
      for (Results* part : {&a, &b}) {
        for (const auto& sample : part->samples[m]) joined.insert(joined.end(), {sample.time, sample.value});
      }
      for (const auto& sample : through.samples[m]) expected.insert(expected.end(), {sample.time, sample.value});
      EXPECT_EQ(joined, expected) << "cut after step " << cut;
      for (const auto& [number, bin] : through.bins[m]) {
        const Bin& other = a.bins[m].count(number) ? a.bins[m].at(number) : b.bins[m].at(number);
        EXPECT_EQ(other.mean, bin.mean);
        EXPECT_EQ(other.deviation, bin.deviation);
        EXPECT_EQ(other.step, bin.step);
      }
    }
  }
}

TEST(Monitors, AStateOfOtherMonitorsIsRefused) {
  const Box box;
  const Monitors one(scene_of(box.decomposition), {every_step(MassBalance{})}, {});
  Monitors two(scene_of(box.decomposition), {every_step(MassBalance{}), every_step(MaxOverlap{})}, {});
  try {
    two.restore(one.state());
    FAIL() << "nothing was refused";
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::checkpoint_corrupt);
  }
}

TEST(Monitors, EveryRankHoldsTheSameState) {
  Box box;
  for (int i = 0; i < 8; ++i) box.add({0.02 + 0.05 * i, 0.35 + 0.01 * i, 0.03 + 0.02 * i}, {0.1, i / 3.0, -1.0 / 7});
  Monitors monitors(
      scene_of(box.decomposition),
      {averaged(KineticEnergy{}, 0, 5, 1), averaged(VelocityProfile{.height = 0.4, .half_height = 0.1, .bins = 3}, 0, 5, 1)}, {});
  walk(monitors, box.observation(), 0, 3, same);
  const Comm& comm = box.decomposition.comm();
  for (const double number : monitors.state()) {
    EXPECT_EQ(comm.max(number), number);
    EXPECT_EQ(comm.min(number), number);
  }
}

}  // namespace
}  // namespace bedflow
