#include "parallel/ghosts.h"

#include <algorithm>
#include <bit>
#include <sstream>

#include "base/stop.h"

namespace bedflow {

namespace {

constexpr std::size_t row_length = 7;  // id, place, shift
constexpr const char* direction_names = "xyz";

void put(std::vector<double>& message, Vec3 v) {
  message.insert(message.end(), {v.x, v.y, v.z});
}

}  // namespace

GhostExchange::GhostExchange(const Decomposition& decomposition, double reach) : decomposition_(decomposition), reach_(reach) {
  for (int d = 0; d < 3; ++d) {
    const double width = decomposition.comm().min(decomposition.high()[d] - decomposition.low()[d]);
    const bool cut = decomposition.ranks()[d] > 1;
    if (cut && width < reach) {
      std::ostringstream message;
      message << "domain.size." << direction_names[d] << ": cut over " << decomposition.ranks()[d] << " ranks a block is "
              << width << " m wide, narrower than the " << reach
              << " m that its particles reach; use fewer ranks or a smaller particles.skin";
      throw Stop(Reason::invalid_case, message.str());
    }
    // Nearer than this a particle would meet two images of the same other one.
    if (decomposition.periodic(d) && decomposition.size()[d] < 2 * reach) {
      std::ostringstream message;
      message << "domain.size." << direction_names[d] << ": " << decomposition.size()[d]
              << " m is too little for a periodic direction; "
              << "at least twice the reach of its particles is needed: " << 2 * reach
              << " m; widen the box or choose a smaller particles.skin";
      throw Stop(Reason::invalid_case, message.str());
    }
  }
}

void GhostExchange::choose(std::vector<Vec3>& place, std::vector<std::int64_t>& id) {
  stages_.clear();
  shift_.clear();
  for (int d = 0; d < 3; ++d) {
    if (decomposition_.at_face(d, 0) && decomposition_.at_face(d, 1)) continue;
    const std::size_t candidates = place.size();  // what comes in this direction is not sent back in it
    Stage& stage = stages_.emplace_back();
    stage.neighbours = {decomposition_.neighbour(d, 0), decomposition_.neighbour(d, 1)};
    for (int side = 0; side < 2; ++side) pass(stage, d, side, candidates, place, id);
  }
}

// Sends towards `side`, receives from the other.
void GhostExchange::pass(Stage& stage, int d, int side, std::size_t candidates, std::vector<Vec3>& place,
                         std::vector<std::int64_t>& id) {
  const int to = stage.neighbours[side], from = stage.neighbours[1 - side];
  const std::size_t owned = place.size() - shift_.size();
  std::vector<double>&message = send_[side], &come = receive_[1 - side];
  message.clear();
  if (to >= 0) {
    const double wrap = decomposition_.wraps(d, side) ? (side == 0 ? 1 : -1) * decomposition_.size()[d] : 0;
    const double low = decomposition_.low()[d] + reach_, high = decomposition_.high()[d] - reach_;
    for (std::size_t i = 0; i < candidates; ++i) {
      Vec3 shift = i < owned ? Vec3{} : shift_[i - owned];
      const double x = place[i][d] + shift[d];
      if (side == 0 ? x >= low : x < high) continue;
      shift[d] += wrap;
      stage.send[side].push_back(static_cast<std::uint32_t>(i));
      message.push_back(std::bit_cast<double>(id[i]));
      put(message, place[i]);
      put(message, shift);
    }
  }
  decomposition_.comm().exchange(to, message, from, come);
  const std::size_t count = come.size() / row_length;
  stage.first[1 - side] = place.size();
  stage.count[1 - side] = count;
  for (std::size_t i = 0; i < count; ++i) {
    const double* row = come.data() + i * row_length;
    id.push_back(std::bit_cast<std::int64_t>(row[0]));
    place.push_back({row[1], row[2], row[3]});
    shift_.push_back({row[4], row[5], row[6]});
  }
}

void GhostExchange::forward(std::span<const Column> columns) {
  std::size_t width = 0;
  for (const Column& column : columns) width += column.width;
  for (const Stage& stage : stages_) {
    for (int side = 0; side < 2; ++side) {
      send_[side].resize(stage.send[side].size() * width);
      receive_[side].resize(stage.count[side] * width);
      double* out = send_[side].data();
      for (const std::uint32_t i : stage.send[side])
        for (const Column& column : columns) out = std::copy_n(column.data + i * column.stride, column.width, out);
    }
    decomposition_.comm().exchange(stage.neighbours, send_, receive_);
    for (int side = 0; side < 2; ++side) {
      const double* in = receive_[side].data();
      for (std::size_t i = stage.first[side]; i < stage.first[side] + stage.count[side]; ++i)
        for (const Column& column : columns) {
          std::copy_n(in, column.width, column.data + i * column.stride);
          in += column.width;
        }
    }
  }
}

}  // namespace bedflow
