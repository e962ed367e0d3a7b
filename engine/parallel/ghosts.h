// Ghost particles: copies of what other blocks, or the other side of a periodic box, have near this block.
//
// Staged (Plimpton 1995): across x, then y, then z, each stage passing on what the earlier ones brought, so edges and corners
// come without messages of their own. A ghost's place stays where its owner has it; how far away its periodic image stands
// is kept beside it. So both owners of a pair find the same difference of places, to the last bit.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "parallel/decomposition.h"

namespace bedflow {

class GhostExchange {
 public:
  // reach: how far from this block ghosts are wanted, m; no block may be narrower (collective; throws Stop(invalid_case)).
  GhostExchange(const Decomposition& decomposition, double reach);

  // From the next choice on; not beyond the reach of the beginning.
  void set_reach(double reach) { reach_ = reach; }
  // Chooses the ghosts anew by the places of the owned particles (m, as their owners have them) and appends the ghosts' places
  // and ids.
  void choose(std::vector<Vec3>& place, std::vector<std::int64_t>& id);
  // The first `width` doubles of each row of an array over owned + ghosts, rows `stride` doubles apart.
  struct Column {
    double* data;
    std::size_t stride, width;
  };
  // Brings the owned rows of each column to the ghosts that were chosen. No allocation.
  void forward(std::span<const Column> columns);

  // Of each ghost: what to add to its place to stand beside this block, m.
  const std::vector<Vec3>& shifts() const { return shift_; }

 private:
  struct Stage {  // of a direction, by the side
    std::array<int, 2> neighbours{};
    std::array<std::vector<std::uint32_t>, 2> send;  // rows
    std::array<std::size_t, 2> first{}, count{};     // rows received
  };
  void pass(Stage& stage, int d, int side, std::size_t candidates, std::vector<Vec3>& place, std::vector<std::int64_t>& id);

  const Decomposition& decomposition_;
  double reach_;
  std::vector<Stage> stages_;
  std::vector<Vec3> shift_;
  std::array<std::vector<double>, 2> send_, receive_;
};

}  // namespace bedflow
