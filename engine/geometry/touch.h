// Where a sphere meets a wall, and how many contacts the points that it meets amount to.
//
// A wall is met through facets, faces, or the two sides of a cone, each with its nearest point p, unit normal n (from the wall to
// the centre) and distance. Of these, nearest first, a further point q counts as a contact of its own only where the wall rises
// towards the sphere from each contact p found before, by more than half the feature angle φ:
//
//   (q − p)·n > sin(φ/2) |q − p|
//
// On a plane, and on any convex body, nothing rises above the tangent plane: one contact, be it on a face, an edge or a vertex.
// Two planes that meet at a concave edge with the angle θ between their normals touch a sphere at points that rise by θ/2: they
// are two contacts for θ > φ, and one smooth wall below. Contacts of one wall then differ by more than φ in their normals.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "base/vec3.h"

namespace bedflow {

struct Touch {
  Vec3 point;           // of the wall, m
  Vec3 normal;          // unit, from the wall to the centre of the sphere
  double distance = 0;  // from the centre to the wall, m; negative beyond a wall that has one side only
};

inline constexpr double one_point = 1e-9;  // of the distance: points nearer than that to each other differ by round-off
inline constexpr double smooth_rise = 0.25881904510252074;  // sin(φ/2) for φ = 30°

// The points at which a sphere meets one wall. Reused from sphere to sphere, so that it allocates nothing.
class Touches {
 public:
  void clear() { found_.clear(); }
  bool empty() const { return found_.empty(); }
  void add(const Touch& touch) { found_.push_back(touch); }

  // The contacts, nearest first. What is equally near keeps the order in which it was added.
  std::span<const Touch> contacts(double rise = smooth_rise) {
    if (found_.size() < 2) return found_;
    // Few, mostly sorted already; std::stable_sort would allocate.
    for (auto next = found_.begin() + 1; next != found_.end(); ++next) {
      const auto place =
          std::upper_bound(found_.begin(), next, *next, [](const Touch& a, const Touch& b) { return a.distance < b.distance; });
      std::rotate(place, next, next + 1);
    }
    std::size_t count = 1;
    for (std::size_t q = 1; q < found_.size(); ++q) {
      const bool own =
          std::all_of(found_.begin(), found_.begin() + static_cast<std::ptrdiff_t>(count), [&](const Touch& contact) {
            const Vec3 way = found_[q].point - contact.point;
            return dot(way, contact.normal) > rise * norm(way) + one_point * contact.distance;
          });
      if (own) found_[count++] = found_[q];
    }
    found_.resize(count);
    return found_;
  }

 private:
  std::vector<Touch> found_;
};

// Which side of a closed surface the particles stay on.
enum class Keep { inside, outside, either };

// A box that holds something; unbounded is ±infinity.
struct Bounds {
  Vec3 low, high;  // m
};

}  // namespace bedflow
