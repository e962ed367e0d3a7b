#include "checkpoint/held_checkpoint.h"

#include <algorithm>
#include <array>

namespace bedflow {

namespace {

// The cells that two parts share; no cell where a count is 0.
GridPart shared(const GridPart& a, const GridPart& b) {
  GridPart common = a;
  for (int d = 0; d < 3; ++d) {
    common.first[d] = std::max(a.first[d], b.first[d]);
    common.count[d] = std::max(0, std::min(a.first[d] + a.count[d], b.first[d] + b.count[d]) - common.first[d]);
  }
  return common;
}

// Calls visit(place) with the place in the values of `part` of each cell of `inner`, x fastest.
template <class Visit>
void each_place(const GridPart& part, const GridPart& inner, Visit visit) {
  for (int k = 0; k < inner.count[2]; ++k)
    for (int j = 0; j < inner.count[1]; ++j)
      for (int i = 0; i < inner.count[0]; ++i) {
        const auto x = static_cast<std::size_t>(inner.first[0] - part.first[0] + i);
        const auto y = static_cast<std::size_t>(inner.first[1] - part.first[1] + j);
        const auto z = static_cast<std::size_t>(inner.first[2] - part.first[2] + k);
        visit(x + static_cast<std::size_t>(part.count[0]) * (y + static_cast<std::size_t>(part.count[1]) * z));
      }
}

// The parts of all ranks.
std::vector<GridPart> all_parts(const Comm& comm, const GridPart& mine) {
  std::vector<double> numbers;
  for (const Int3& triple : {mine.first, mine.count}) numbers.insert(numbers.end(), triple.begin(), triple.end());
  const std::vector<double> all = comm.gather_all(numbers);
  std::vector<GridPart> parts(all.size() / 6, mine);
  for (std::size_t r = 0; r < parts.size(); ++r)
    for (int d = 0; d < 3; ++d) {
      parts[r].first[d] = static_cast<int>(all[6 * r + d]);
      parts[r].count[d] = static_cast<int>(all[6 * r + 3 + d]);
    }
  return parts;
}

}  // namespace

const CheckpointArray* HeldCheckpoint::find(const std::string& array) const {
  const auto found = std::ranges::find(content_.arrays, array, &CheckpointArray::name);
  return found == content_.arrays.end() ? nullptr : &*found;
}

std::vector<double> HeldCheckpoint::rows(const std::string& array) const {
  return std::get<std::vector<double>>(find(array)->values);
}
std::vector<std::int64_t> HeldCheckpoint::integer_rows(const std::string& array) const {
  return std::get<std::vector<std::int64_t>>(find(array)->values);
}

// Each rank sends what it holds of what each wants.
std::vector<double> HeldCheckpoint::grid(const std::string& array, const GridPart& part) const {
  const GridPart& held = *find(array)->part;
  const auto& values = std::get<std::vector<double>>(find(array)->values);
  const std::vector<GridPart> wanted = all_parts(comm_, part), holding = all_parts(comm_, held);
  std::vector<std::vector<double>> messages(comm_.size());
  for (int r = 0; r < comm_.size(); ++r)
    each_place(held, shared(held, wanted[r]), [&](std::size_t place) { messages[r].push_back(values[place]); });
  const auto received = comm_.exchange_all(messages);
  std::vector<double> result(static_cast<std::size_t>(part.count[0]) * part.count[1] * part.count[2]);
  for (int r = 0; r < comm_.size(); ++r) {
    const double* next = received[r].data();
    each_place(part, shared(part, holding[r]), [&](std::size_t place) { result[place] = *next++; });
  }
  return result;
}

}  // namespace bedflow
