// Arrays of particles in a new order. What it takes is kept: rebuilding the pair list is frequent, and memory that the system
// hands out anew costs several times what moving it does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace bedflow {

class Reorder {
 public:
  std::vector<std::uint32_t> order;  // order[new] = old

  template <class T>
  void operator()(std::vector<T>& elements) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (order.empty()) return elements.clear();
    const std::size_t bytes = order.size() * sizeof(T);
    if (room_.size() < bytes) room_.resize(bytes);
    std::byte* to = room_.data();
    for (const std::uint32_t old : order) {
      std::memcpy(to, &elements[old], sizeof(T));
      to += sizeof(T);
    }
    elements.resize(order.size());
    std::memcpy(static_cast<void*>(elements.data()), room_.data(), bytes);
  }

 private:
  std::vector<std::byte> room_;
};

}  // namespace bedflow
