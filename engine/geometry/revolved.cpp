#include "geometry/revolved.h"

#include <cmath>
#include <limits>

namespace bedflow {

Revolved::Revolved(Vec3 origin, Vec3 axis, std::vector<Corner> profile, Keep keep)
    : origin_(origin), axis_(1 / norm(axis) * axis), profile_(std::move(profile)), keep_(keep) {
  int smallest = 0;
  for (int d = 1; d < 3; ++d)
    if (std::abs(axis_[d]) < std::abs(axis_[smallest])) smallest = d;
  Vec3 other;
  other[smallest] = 1;
  const Vec3 across = cross(axis_, other);
  across_ = 1 / norm(across) * across;
}

Revolved Revolved::cone(Vec3 from, Vec3 to, double radius_from, double radius_to, bool closed, Keep keep) {
  const double length = norm(to - from);
  std::vector<Corner> profile{{radius_from, 0}, {radius_to, length}};
  if (closed && radius_from > 0) profile.insert(profile.begin(), {0, 0});
  if (closed && radius_to > 0) profile.push_back({0, length});
  return {from, to - from, std::move(profile), keep};
}

Revolved Revolved::cylinder(Vec3 from, Vec3 to, double radius, bool closed, Keep keep) {
  return cone(from, to, radius, radius, closed, keep);
}

Revolved::Place Revolved::place(Vec3 x) const {
  const Vec3 way = x - origin_;
  const double height = dot(way, axis_);
  const Vec3 outward = way - height * axis_;
  const double radius = norm(outward);
  return {radius, height, radius > 0 ? 1 / radius * outward : across_};
}

// side: +1 the profile on the sphere's side of the axis, −1 its mirror image.
void Revolved::touch_line(std::size_t line, Vec3 x, const Place& centre, double side, double reach, Touches& touches) const {
  const Corner a = profile_[line], b = profile_[line + 1];
  const double along_r = b.radius - a.radius, along_h = b.height - a.height;
  const double from_r = side * centre.radius - a.radius, from_h = centre.height - a.height;
  const double length2 = along_r * along_r + along_h * along_h, share = (from_r * along_r + from_h * along_h) / length2;
  double away_r, away_h, away;
  if (share > 0 && share < 1) {  // onto the line itself: the normal is the line's, not a difference of near places
    const double length = std::sqrt(length2), signed_away = (from_h * along_r - from_r * along_h) / length;
    away = std::abs(signed_away);
    const double sign = signed_away < 0 ? -1 : 1;
    away_r = -sign * along_h / length;
    away_h = sign * along_r / length;
  } else {
    const Corner& end = share > 0 ? b : a;
    away_r = side * centre.radius - end.radius;
    away_h = centre.height - end.height;
    away = std::hypot(away_r, away_h);
    if (away > 0) {
      away_r /= away;
      away_h /= away;
    } else {  // on the rim: towards the axis
      away_r = -1;
      away_h = 0;
    }
  }
  if (!(away < reach)) return;
  const Vec3 normal = side * away_r * centre.outward + away_h * axis_;
  touches.add({x - away * normal, normal, away});
}

void Revolved::touch(Vec3 x, double reach, Touches& touches) const {
  const Place centre = place(x);
  for (std::size_t line = 0; line + 1 < profile_.size(); ++line)
    for (const double side : {1.0, -1.0}) touch_line(line, x, centre, side, reach, touches);
}

// Even–odd rule in the half plane of the profile, which the axis closes.
bool Revolved::passed(Vec3 x) const {
  if (keep_ == Keep::either || !closed()) return false;
  const Place centre = place(x);
  bool inside = false;
  for (std::size_t line = 0; line + 1 < profile_.size(); ++line) {
    const Corner a = profile_[line], b = profile_[line + 1];
    if ((a.height > centre.height) == (b.height > centre.height)) continue;
    const double radius = a.radius + (centre.height - a.height) / (b.height - a.height) * (b.radius - a.radius);
    if (radius > centre.radius) inside = !inside;
  }
  return inside == (keep_ == Keep::outside);
}

Bounds Revolved::bounds() const {
  constexpr double far = std::numeric_limits<double>::infinity();
  Bounds result{{far, far, far}, {-far, -far, -far}};
  for (const Corner& corner : profile_)
    for (int d = 0; d < 3; ++d) {  // a ring of this radius
      const double middle = origin_[d] + corner.height * axis_[d];
      const double half = corner.radius * std::sqrt(std::max(0.0, 1 - axis_[d] * axis_[d]));
      result.low[d] = std::min(result.low[d], middle - half);
      result.high[d] = std::max(result.high[d], middle + half);
    }
  return result;
}

}  // namespace bedflow
