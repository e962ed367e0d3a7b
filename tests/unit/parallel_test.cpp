#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

#include "base/stop.h"
#include "grid/halo.h"
#include "parallel/decomposition.h"

namespace bedflow {
namespace {

// A value that tells the global cell it belongs to.
double label(const Grid& g, int i, int j, int k) {
  const auto wrap = [&](int d, int local) { return (g.first[d] + local + g.global[d]) % g.global[d]; };
  return wrap(0, i) + 100.0 * wrap(1, j) + 10000.0 * wrap(2, k);
}

TEST(Decomposition, BlocksCoverEveryCellOnce) {
  const Decomposition d(Comm::world(), {7, 9, 5}, {0.7, 0.9, 0.5}, {false, true, false});
  long cells = 1;
  for (int c : d.cells()) cells *= c;
  EXPECT_EQ(d.comm().sum(std::int64_t{cells}), 7 * 9 * 5);
  for (int x = 0; x < 7; ++x)
    for (int y = 0; y < 9; ++y)
      for (int z = 0; z < 5; ++z) {
        const bool mine = x >= d.first()[0] && x < d.first()[0] + d.cells()[0] && y >= d.first()[1] &&
                          y < d.first()[1] + d.cells()[1] && z >= d.first()[2] && z < d.first()[2] + d.cells()[2];
        EXPECT_EQ(d.owner({0.1 * x + 0.05, 0.1 * y + 0.05, 0.1 * z + 0.05}) == d.comm().rank(), mine);
      }
}

TEST(Decomposition, RanksThatDoNotFitAreRefusedByName) {
  try {
    const Decomposition d(Comm::world(), {1, 1, 1}, {1, 1, 1}, {false, false, false}, -1, {2, 2, 2});
    FAIL() << "nothing was refused";
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::invalid_case);
    EXPECT_NE(std::string(stop.what()).find("1 x 1 x 1"), std::string::npos);
  }
}

// The dearest part of all divisions that are allowed, one by one.
double dearest_of_best(const std::vector<double>& cost, std::size_t first, int parts, int narrowest) {
  double sum = 0;
  if (parts == 1) {
    for (std::size_t c = first; c < cost.size(); ++c) sum += cost[c];
    return sum;
  }
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t end = first; end + static_cast<std::size_t>((parts - 1) * narrowest) <= cost.size(); ++end) {
    if (end >= first + static_cast<std::size_t>(narrowest))
      best = std::min(best, std::max(sum, dearest_of_best(cost, end, parts - 1, narrowest)));
    if (end < cost.size()) sum += cost[end];
  }
  return best;
}

TEST(Decomposition, CheapestCutsAreTheBestOfAll) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> any(0, 9);  // whole numbers: sums without round-off
  for (int round = 0; round < 300; ++round) {
    const int narrowest = 1 + round % 3, parts = 1 + round / 3 % 4;
    std::vector<double> cost(static_cast<std::size_t>(parts * narrowest + round % 7));
    for (double& c : cost) c = std::max(0, any(random) - 4);
    const std::vector<int> cuts = cheapest_cuts(cost, parts, narrowest);
    ASSERT_EQ(cuts.size(), static_cast<std::size_t>(parts) + 1);
    EXPECT_EQ(cuts.front(), 0);
    EXPECT_EQ(cuts.back(), static_cast<int>(cost.size()));
    double dearest = 0;
    for (int part = 0; part < parts; ++part) {
      EXPECT_GE(cuts[part + 1] - cuts[part], narrowest);
      dearest = std::max(dearest, std::accumulate(cost.begin() + cuts[part], cost.begin() + cuts[part + 1], 0.0));
    }
    EXPECT_EQ(dearest, dearest_of_best(cost, 0, parts, narrowest));
  }
}

TEST(Decomposition, UnevenBlocksCoverTheBoxAndKnowTheirOwners) {
  const Comm world = Comm::world();
  const Decomposition even(world, {16, 8, 4}, {1.6, 0.8, 0.4}, {false, true, false});
  Cuts cuts = even.cuts();
  for (auto& direction : cuts)
    if (direction.size() > 2) direction[1] -= 1;
  const Decomposition uneven(world, even.size(), {false, true, false}, cuts);
  EXPECT_EQ(world.sum(static_cast<std::int64_t>(uneven.cells()[0]) * uneven.cells()[1] * uneven.cells()[2]), 16 * 8 * 4);
  EXPECT_EQ(uneven.owner(0.5 * (uneven.low() + uneven.high())), world.rank());
  EXPECT_EQ(uneven.owner(uneven.low() + Vec3{1e-6, 1e-6, 1e-6}), world.rank());
  EXPECT_EQ(uneven.owner(uneven.high() - Vec3{1e-6, 1e-6, 1e-6}), world.rank());
}

TEST(Halo, FillBringsWhatTheOwnerHoldsEdgesAndCornersToo) {
  for (const int ghosts : {1, 2}) {
    const Decomposition d(Comm::world(), {8, 8, 8}, {1, 1, 1}, {true, true, true});
    const Grid grid(d, ghosts);
    PhaseTimer timer;
    Halo halo(d, grid, timer);
    Field f(grid, -1);
    for (int k = 0; k < grid.cells[2]; ++k)
      for (int j = 0; j < grid.cells[1]; ++j)
        for (int i = 0; i < grid.cells[0]; ++i) f(i, j, k) = label(grid, i, j, k);
    halo.fill(f);
    for (int k = -ghosts; k < grid.cells[2] + ghosts; ++k)
      for (int j = -ghosts; j < grid.cells[1] + ghosts; ++j)
        for (int i = -ghosts; i < grid.cells[0] + ghosts; ++i)
          ASSERT_EQ(f(i, j, k), label(grid, i, j, k)) << i << " " << j << " " << k;
  }
}

TEST(Halo, FillLeavesFacesOfTheBoxAlone) {
  const Decomposition d(Comm::self(), {3, 3, 3}, {1, 1, 1}, {false, false, false});
  const Grid grid(d);
  PhaseTimer timer;
  Halo halo(d, grid, timer);
  Field f(grid, 7);
  halo.fill(f);
  EXPECT_EQ(f(-1, 1, 1), 7);
  EXPECT_EQ(f(3, 1, 1), 7);
}

// <add(a), b> = <a, fill(b)>: integers in the fields, so that the sums are exact.
TEST(Halo, AddIsTheTransposeOfFill) {
  const Decomposition d(Comm::world(), {6, 5, 4}, {1, 1, 1}, {true, false, true});
  const Grid grid(d);
  PhaseTimer timer;
  Halo halo(d, grid, timer);
  Field a(grid), b(grid);
  unsigned state = 12345u + static_cast<unsigned>(d.comm().rank());
  const auto next = [&] { return static_cast<double>((state = state * 1664525u + 1013904223u) >> 24); };
  const auto inside = [&](int dir, int i) {  // a ghost beyond a face of the box takes part in neither
    return !(i < 0 && d.at_face(dir, 0)) && !(i >= grid.cells[dir] && d.at_face(dir, 1));
  };
  const auto product = [&](const Field& p, const Field& q, int g) {
    double sum = 0;
    for (int k = -g; k < grid.cells[2] + g; ++k)
      for (int j = -g; j < grid.cells[1] + g; ++j)
        for (int i = -g; i < grid.cells[0] + g; ++i)
          if (inside(0, i) && inside(1, j) && inside(2, k)) sum += p(i, j, k) * q(i, j, k);
    return d.comm().sum(sum);
  };
  for (int k = -1; k <= grid.cells[2]; ++k)
    for (int j = -1; j <= grid.cells[1]; ++j)
      for (int i = -1; i <= grid.cells[0]; ++i) {
        if (inside(0, i) && inside(1, j) && inside(2, k)) a(i, j, k) = next();
        b(i, j, k) = next();
      }
  Field filled = b, added = a;
  halo.fill(filled);
  halo.add(added);
  EXPECT_EQ(product(a, filled, 1), product(added, b, 0));
}

TEST(Comm, ReductionsAreTheSameOnEveryRank) {
  const Comm world = Comm::world();
  const int n = world.size();
  EXPECT_EQ(world.sum(std::int64_t{world.rank()}), n * (n - 1) / 2);
  EXPECT_EQ(world.max(static_cast<double>(world.rank())), n - 1);
  EXPECT_EQ(world.min(static_cast<double>(world.rank())), 0);
  EXPECT_TRUE(world.any(world.rank() == n - 1));
  EXPECT_FALSE(world.any(false));
  EXPECT_EQ(world.sum_before(2), 2 * world.rank());
  EXPECT_EQ(world.broadcast(world.root() ? "from the root" : ""), "from the root");
}

TEST(Comm, AMaximumIsUnderWayWhileExchangesPass) {
  const Comm world = Comm::world();
  for (int round = 0; round < 100; ++round) {
    world.begin_max(round % world.size() == world.rank() ? round : -1);
    const std::vector<double> ours(8, world.rank());
    std::array<std::vector<double>, 2> receive = {ours, ours};
    const int next = (world.rank() + 1) % world.size(), before = (world.rank() + world.size() - 1) % world.size();
    world.exchange({before, next}, {ours, ours}, receive);
    EXPECT_EQ(receive[0].front(), before);
    EXPECT_EQ(receive[1].front(), next);
    EXPECT_EQ(world.end_max(), round);
  }
}

TEST(Comm, WhatIsSentTowardsOneSideComesFromTheOther) {
  const Comm world = Comm::world();
  const int next = (world.rank() + 1) % world.size(), before = (world.rank() + world.size() - 1) % world.size();
  const auto said = [](int rank, int side) { return std::vector<float>(3, static_cast<float>(2 * rank + side)); };
  const Traffic earlier = world.traffic();
  std::array<std::vector<float>, 2> receive = {std::vector<float>(3), std::vector<float>(3)};
  world.exchange({before, next}, {said(world.rank(), 0), said(world.rank(), 1)}, receive);
  EXPECT_EQ(receive[0], said(before, 1));
  EXPECT_EQ(receive[1], said(next, 0));
  const Traffic traffic = world.traffic() - earlier;
  EXPECT_EQ(traffic.messages, world.size() > 1 ? 2 : 0);
  EXPECT_EQ(traffic.bytes, world.size() > 1 ? 24 : 0);
}

TEST(Comm, RanksOfOneMachineAreOnOneMachine) {
  EXPECT_EQ(Comm::world().machines(), 1);
  EXPECT_EQ(Comm::self().machines(), 1);
}

TEST(Comm, ExchangeAllDeliversEveryMessage) {
  const Comm world = Comm::world();
  std::vector<std::vector<double>> messages(world.size());
  for (int to = 0; to < world.size(); ++to) messages[to].assign(to + 1, 10.0 * world.rank() + to);
  const auto received = world.exchange_all(messages);
  for (int from = 0; from < world.size(); ++from) {
    EXPECT_EQ(received[from], std::vector<double>(world.rank() + 1, 10.0 * from + world.rank()));
  }
}

TEST(Comm, TrafficIsWhatWasSentToOthers) {
  const Comm world = Comm::world();
  const int next = (world.rank() + 1) % world.size(), previous = (world.rank() + world.size() - 1) % world.size();
  const Traffic before = world.traffic();
  const Comm copy = world;  // NOLINT(performance-unnecessary-copy-initialization): that is what is tested
  const std::vector<double> sent(5, 1.0);
  std::vector<double> received;
  copy.exchange(next, sent, previous, received);
  copy.exchange(-1, sent, -1, received);
  copy.any(true);
  const Traffic traffic = world.traffic() - before;
  const bool others = world.size() > 1;
  EXPECT_EQ(traffic.messages, others ? 1 : 0);
  EXPECT_EQ(traffic.bytes, others ? 40 : 0);
  EXPECT_EQ(traffic.collectives, others ? 1 : 0);
  EXPECT_EQ(traffic.seconds > 0, others);
}

}  // namespace
}  // namespace bedflow
